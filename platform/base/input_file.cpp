// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "base/input_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include "base/system_failure.hpp"

namespace tessera {

Outcome<InputFile> InputFile::open(std::string_view path) {
  InputFile input;
  if (path.size() >= kMaxPathBytes) {
    return system_failure("read", path, ENAMETOOLONG, FailureKind::kUsage);
  }
  std::copy(path.begin(), path.end(), input.path_.begin());
  input.path_bytes_ = path.size();
  // O_NONBLOCK: opening a pipe without a writer would wait forever; regular files ignore it.
  input.file_ = FileDescriptor(::open(input.path_.data(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  struct stat status {};
  if (!input.file_.is_open() || ::fstat(input.file_.get(), &status) != 0) {
    return system_failure("read", path, errno, FailureKind::kUsage);
  }
  if (S_ISDIR(status.st_mode)) return system_failure("read", path, EISDIR, FailureKind::kUsage);
  if (!S_ISREG(status.st_mode)) {
    return Failure{"cannot read " + std::string(path) +
                   ": it is not a regular file; copy its content into one first"};
  }
  input.size_bytes_ = static_cast<std::uint64_t>(status.st_size);
  return input;
}

Outcome<std::size_t> InputFile::read(std::span<std::byte> into) {
  std::size_t filled = 0;
  while (filled < into.size()) {
    const ssize_t count = ::read(file_.get(), into.data() + filled, into.size() - filled);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return system_failure("read", path(), errno, FailureKind::kFailure);
    if (count == 0) break;
    filled += static_cast<std::size_t>(count);
  }
  position_bytes_ += filled;
  return filled;
}

Outcome<void> InputFile::read_exactly(std::span<std::byte> into) {
  const Outcome<std::size_t> count = read(into);
  if (!count.ok()) return count.failure();
  if (*count == into.size()) return {};
  return Failure{"cannot read " + std::string(path()) + ": it ends after " +
                     std::to_string(position_bytes_) + " bytes, too early by " +
                     std::to_string(into.size() - *count) +
                     "; it is truncated, get a complete copy",
                 FailureKind::kFailure};
}

Outcome<std::string> read_text_file(std::string_view path, std::size_t max_bytes) {
  Outcome<InputFile> input = InputFile::open(path);
  if (!input.ok()) return input.failure();
  if (input->size_bytes() > max_bytes) {
    return Failure{"cannot read " + std::string(path) + ": it has " +
                   std::to_string(input->size_bytes()) + " bytes, the limit is " +
                   std::to_string(max_bytes) + "; check that it is the right file"};
  }
  std::string text(static_cast<std::size_t>(input->size_bytes()), '\0');
  const Outcome<std::size_t> count = input->read(std::as_writable_bytes(std::span(text)));
  if (!count.ok()) return count.failure();
  text.resize(*count);
  // Some editors write this mark before UTF-8; it is not part of the text.
  if (constexpr std::string_view kMark = "\xef\xbb\xbf"; text.starts_with(kMark))
    text.erase(0, kMark.size());
  return text;
}

}  // namespace tessera
