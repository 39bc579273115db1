// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A file that appears under its name only when it is complete: bytes go to a temporary name in the
// same folder, commit() renames it. Whatever goes wrong before that leaves the target untouched and
// nothing else behind.
#pragma once

#include <cstddef>
#include <cstdio>
#include <string>

#include "posix/outcome.hpp"

namespace tessera {

class TargetFile {
 public:
  /// Fails with kUsage iff path is a folder, a device or the like, or its folder cannot be written
  /// to.
  static Outcome<TargetFile> create(const std::string& path);

  TargetFile(TargetFile&& other) noexcept;
  TargetFile& operator=(TargetFile&& other) noexcept;
  TargetFile(const TargetFile&) = delete;
  TargetFile& operator=(const TargetFile&) = delete;
  ~TargetFile();

  /// Appends bytes. Errors are kept and reported by commit().
  void write(const void* bytes, std::size_t count);
  /// For libraries that write to streams themselves.
  [[nodiscard]] std::FILE* stream() const { return stream_; }
  /// Closes and renames. Fails with kFailure iff a write or the renaming failed; the target is then
  /// as it was.
  Outcome<void> commit();

 private:
  TargetFile(std::string path, std::string target, std::string temporary, std::FILE* stream);
  void discard() noexcept;

  std::string path_;       ///< As the user typed it, for messages.
  std::string target_;     ///< With symbolic links followed.
  std::string temporary_;  ///< Empty once committed or discarded.
  std::FILE* stream_ = nullptr;
  int error_ = 0;
};

}  // namespace tessera
