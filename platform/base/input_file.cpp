// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "base/input_file.hpp"

#include <fcntl.h>
#include <fmt/core.h>
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

/// A regular file takes any place up to its own limit.
void InputFile::skip_to(std::uint64_t position_bytes) noexcept {
  ::lseek(file_.get(), static_cast<off_t>(position_bytes), SEEK_SET);
  position_bytes_ = position_bytes;
}

Outcome<void> InputFile::read_exactly(std::span<std::byte> into) {
  TESSERA_TRY_ASSIGN(const std::size_t count, read(into));
  if (count == into.size()) return {};
  return Failure{fmt::format("cannot read {}: it ends after {} bytes, too early by {}; it is "
                             "truncated, get a complete copy",
                             path(), position_bytes_, into.size() - count),
                 FailureKind::kFailure};
}

Outcome<std::string> read_text_file(std::string_view path, std::size_t max_bytes) {
  TESSERA_TRY_ASSIGN(InputFile input, InputFile::open(path));
  if (input.size_bytes() > max_bytes) {
    return Failure{fmt::format(
        "cannot read {}: it has {} bytes, the limit is {}; check that it is the right file", path,
        input.size_bytes(), max_bytes)};
  }
  std::string text(static_cast<std::size_t>(input.size_bytes()), '\0');
  TESSERA_TRY_ASSIGN(const std::size_t count, input.read(std::as_writable_bytes(std::span(text))));
  text.resize(count);
  // Some editors write this mark before UTF-8; it is not part of the text.
  if (constexpr std::string_view kMark = "\xef\xbb\xbf"; text.starts_with(kMark))
    text.erase(0, kMark.size());
  return text;
}

}  // namespace tessera
