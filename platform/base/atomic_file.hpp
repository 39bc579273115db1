// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// An output file that appears under its name only when it is complete: bytes go to a temporary name
// in the same folder, commit() makes them durable and renames. On any failure before that, the
// target stays unchanged and the temporary is removed. If the file system supports it, the
// temporary has no name until commit(), so that a killed process leaves nothing either.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "base/file_descriptor.hpp"
#include "base/outcome.hpp"

namespace tessera {

class AtomicFile {
 public:
  /// Creates the temporary. Symbolic links are followed: the file that they name is replaced.
  /// Fails with kUsage iff path is empty, a folder, a device or the like, write-protected, or its
  /// folder is missing or not writable. This and commit() use the heap, write() does not.
  static Outcome<AtomicFile> open(const std::string& path);

  AtomicFile(AtomicFile&& other) noexcept { swap(other); }
  AtomicFile& operator=(AtomicFile&& other) noexcept;
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;
  ~AtomicFile();

  /// Appends bytes. False iff this or an earlier write failed (or the file is already committed);
  /// commit() then has the reason, so that callers may ignore the value.
  bool write(std::span<const std::byte> bytes) noexcept;
  /// Flushes, syncs, closes, renames. Fails with kFailure iff any of these or an earlier write
  /// failed, or on a second call; nothing is left then, and the target is unchanged.
  Outcome<void> commit();

  /// As typed by the user.
  [[nodiscard]] const std::string& path() const noexcept { return path_; }

 private:
  AtomicFile() = default;
  void swap(AtomicFile& other) noexcept;
  Outcome<void> create_temporary(unsigned mode);
  /// attempt counts from 0, for when a name is taken.
  [[nodiscard]] std::string temporary_name(int attempt) const;
  int name_temporary();
  bool write_through(std::span<const std::byte> bytes) noexcept;
  bool flush() noexcept;
  void discard() noexcept;

  std::string path_;
  std::string target_;     ///< path_ with symbolic links followed.
  std::string temporary_;  ///< Empty while it has no name, and once committed or discarded.
  FileDescriptor file_;
  std::unique_ptr<std::byte[]> buffer_;
  std::size_t buffered_bytes_ = 0;
  int error_ = 0;  ///< The first errno; sticky.
};

}  // namespace tessera
