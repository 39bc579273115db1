/* SPDX-FileCopyrightText: The tessera authors
 * SPDX-License-Identifier: Apache-2.0
 *
 * For user_mode_linux.py, which loads this before the C library: User-Mode Linux of kernel 6.1
 * keeps the registers of a process in a buffer of fixed size, without those of AMX. Since 5.16 the
 * kernel below takes all registers of its processor or none (arch/x86/kernel/fpu/regset.c,
 * xstateregs_set: EFAULT), so that on a processor with AMX the first process in there would end
 * it. Here the registers that are missing are filled in as they are. */
#define _GNU_SOURCE
#include <elf.h>
#include <errno.h>
#include <stdarg.h>
#include <string.h>
#include <sys/ptrace.h>
#include <sys/syscall.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <unistd.h>

static long set_all_registers(pid_t pid, void* what, struct iovec* given) {
  static char registers[1 << 16];
  struct iovec all = {registers, sizeof(registers)};
  if (syscall(SYS_ptrace, PTRACE_GETREGSET, pid, what, &all) != 0) return -1;
  if (all.iov_len <= given->iov_len) return syscall(SYS_ptrace, PTRACE_SETREGSET, pid, what, given);
  memcpy(registers, given->iov_base, given->iov_len);
  return syscall(SYS_ptrace, PTRACE_SETREGSET, pid, what, &all);
}

long ptrace(enum __ptrace_request request, ...) {
  va_list arguments;
  va_start(arguments, request);
  const pid_t pid = va_arg(arguments, pid_t);
  void* const address = va_arg(arguments, void*);
  void* const data = va_arg(arguments, void*);
  va_end(arguments);
  if (request == PTRACE_SETREGSET && address == (void*)NT_X86_XSTATE)
    return set_all_registers(pid, address, data);
  if (request != PTRACE_PEEKTEXT && request != PTRACE_PEEKDATA && request != PTRACE_PEEKUSER)
    return syscall(SYS_ptrace, request, pid, address, data);
  /* As the C library does it: the kernel writes the word, the call gives it. */
  long word = 0;
  if (syscall(SYS_ptrace, request, pid, address, &word) != 0) return -1;
  errno = 0;
  return word;
}
