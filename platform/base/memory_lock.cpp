// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "base/memory_lock.hpp"

#include <fcntl.h>
#include <malloc.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>

#include "base/file_descriptor.hpp"

namespace tessera {

namespace {

std::size_t page_bytes() noexcept {
  static const auto bytes = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  return bytes;
}

/// Writes the existing content: only a written page gets its own memory. The system does it at half
/// of the cost, from Linux 5.14 on.
void touch(std::byte* first, std::size_t bytes) noexcept {
#ifdef MADV_POPULATE_WRITE
  const std::size_t before = reinterpret_cast<std::uintptr_t>(first) % page_bytes();
  if (::madvise(first - before, bytes + before, MADV_POPULATE_WRITE) == 0) return;
#endif
  for (std::size_t at = 0; at < bytes; at += page_bytes()) {
    auto* const byte = reinterpret_cast<volatile std::byte*>(first + at);
    *byte = *byte;
  }
  if (bytes > 0) {
    auto* const last = reinterpret_cast<volatile std::byte*>(first + bytes - 1);
    *last = *last;
  }
}

/// True if the system would give this much more memory; allocates no page.
bool can_take(std::size_t bytes) noexcept {
  if (bytes == 0) return true;
  void* const at =
      ::mmap(nullptr, bytes, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (at == MAP_FAILED) return false;
  ::munmap(at, bytes);
  return true;
}

}  // namespace

std::string lock_memory(std::size_t room_bytes) {
  const bool locked = ::mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
  // Later memory is locked too, so beyond the limit the system would give no memory at all.
  if (locked && can_take(room_bytes)) return {};
  const int error = errno;
  ::munlockall();
  if (error != EPERM && error != ENOMEM && error != EAGAIN) return std::strerror(error);
  return "not permitted; raise the limit of locked memory (ulimit -l, LimitMEMLOCK of systemd)";
}

void prefault(std::span<std::byte> memory) noexcept { touch(memory.data(), memory.size()); }

[[gnu::noinline]] void prefault_stack() noexcept {
  constexpr std::size_t kBytes = std::size_t{256} << 10U;
  // Never read: only its pages are needed.
  std::array<std::byte, kBytes> room;
  for (std::size_t at = 0; at < room.size(); at += 1024)
    *const_cast<volatile std::byte*>(&room[at]) = std::byte{0};
}

void keep_freed_memory() noexcept {
  ::mallopt(M_TRIM_THRESHOLD, -1);
  ::mallopt(M_MMAP_MAX, 0);
  // Each further heap reserves 64 MiB of addresses, which count towards a limit of locked memory.
  ::mallopt(M_ARENA_MAX, 1);
}

PageFaults thread_page_faults() noexcept {
  rusage usage{};
  if (::getrusage(RUSAGE_THREAD, &usage) != 0) return {};
  return {.minor = static_cast<std::uint64_t>(usage.ru_minflt),
          .major = static_cast<std::uint64_t>(usage.ru_majflt)};
}

std::size_t resident_bytes() noexcept {
  const FileDescriptor file(::open("/proc/self/statm", O_RDONLY | O_CLOEXEC));
  if (!file.is_open()) return 0;
  std::array<char, 128> text{};
  const ssize_t size = ::read(file.get(), text.data(), text.size() - 1);
  if (size <= 0) return 0;
  // All pages, then the resident ones.
  const char* const end = text.data() + size;
  const char* at =
      static_cast<const char*>(std::memchr(text.data(), ' ', static_cast<std::size_t>(size)));
  if (at == nullptr) return 0;
  std::size_t pages = 0;
  if (std::from_chars(at + 1, end, pages).ec != std::errc()) return 0;
  return pages * page_bytes();
}

}  // namespace tessera
