// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "base/boot_id.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <array>

#include "base/file_descriptor.hpp"
#include "tessera/base/internal/digest.hpp"

namespace tessera {

std::uint64_t boot_id() {
  const FileDescriptor file(::open("/proc/sys/kernel/random/boot_id", O_RDONLY | O_CLOEXEC));
  std::array<char, 64> text{};
  const ssize_t size = file.is_open() ? ::read(file.get(), text.data(), text.size()) : 0;
  if (size <= 0) return 0;
  Digest digest;
  for (const char letter : text) digest.add(static_cast<unsigned char>(letter));
  return digest.value();
}

}  // namespace tessera
