// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "base/new_file.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>

#include "base/file_descriptor.hpp"
#include "base/system_failure.hpp"

namespace tessera {
namespace {

/// Returns errno.
int write_all(int file, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t count = ::write(file, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return count < 0 ? errno : EIO;
    bytes = bytes.subspan(static_cast<std::size_t>(count));
  }
  return ::fsync(file) == 0 || errno == EINVAL ? 0 : errno;
}

}  // namespace

void sync_folder_of(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  const std::string folder = slash == std::string::npos ? "." : path.substr(0, slash + 1);
  const FileDescriptor file(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (file.is_open()) static_cast<void>(!::fsync(file.get()));
}

Outcome<void> write_new_file(const std::string& path, std::span<const std::byte> bytes,
                             unsigned mode) {
  struct stat existing {};
  if (path.empty()) return Failure{"cannot write: the name of the file is empty; give one"};
  if (::lstat(path.c_str(), &existing) == 0) {
    return Failure{"cannot write " + path +
                   ": it already exists, and is not replaced; choose another name or remove it"};
  }
  const std::string temporary = fmt::format("{}.{}.part", path, ::getpid());
  FileDescriptor file(
      ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, mode));
  if (!file.is_open()) return system_failure("write", path, errno, FailureKind::kUsage);
  int error = write_all(file.get(), bytes);
  if (!file.close() && error == 0) error = errno;
  // Unlike renaming, linking fails if a file of that name was made meanwhile.
  if (error == 0 && ::link(temporary.c_str(), path.c_str()) != 0) error = errno;
  ::unlink(temporary.c_str());
  if (error != 0) return system_failure("write", path, error, FailureKind::kFailure);
  sync_folder_of(path);
  return {};
}

}  // namespace tessera
