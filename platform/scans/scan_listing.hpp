// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The files of a sequence: the scans in a folder, their names and sizes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "base/input_file.hpp"
#include "base/outcome.hpp"

namespace tessera {

inline constexpr int kMaxScanNumber = 999'999;  ///< Names have six digits.

/// Scans first .. last, both included.
struct ScanRange {
  int first = 0;
  int last = 0;
  friend constexpr bool operator==(const ScanRange&, const ScanRange&) = default;
};

/// "<dataset>/<folder>/NNNNNN<extension>", built without the heap; an absolute folder is used
/// alone.
class ScanFilePath {
 public:
  ScanFilePath(std::string_view dataset, std::string_view folder, int scan_number,
               std::string_view extension) noexcept;
  /// A path that is too long stays too long, so that opening it fails for that reason.
  [[nodiscard]] std::string_view view() const noexcept { return {text_.data(), length_}; }
  [[nodiscard]] const char* c_str() const noexcept { return text_.data(); }

 private:
  std::array<char, InputFile::kMaxPathBytes + 1> text_{};
  std::size_t length_ = 0;
};

/// "<dir>/<name>".
[[nodiscard]] std::string in_folder(const std::string& dir, const std::string& name);

/// The numbers of all files NNNNNN.bin in the folder, ascending; other names are ignored. Fails
/// with kUsage iff the folder is missing, unreadable or without such a file.
Outcome<std::vector<int>> list_scans(const std::string& folder);

/// The runs of numbers within range that are not among scans (ascending).
[[nodiscard]] std::vector<ScanRange> missing_scans(const std::vector<int>& scans, ScanRange range);

/// "3, 7-9".
[[nodiscard]] std::string to_text(const std::vector<ScanRange>& ranges);

/// Whether there is a regular file. No heap.
[[nodiscard]] bool is_file(const ScanFilePath& path) noexcept;
/// Fails with kUsage iff the file is missing or not a regular one.
Outcome<std::uint64_t> file_size_bytes(const ScanFilePath& path);
/// The file, if it still has the size that it had when the dataset was opened. Fails with kFailure,
/// as what was valid then and is no longer is not a usage error. No heap unless it fails.
Outcome<InputFile> open_unchanged(const ScanFilePath& path, std::uint64_t expected_bytes);

}  // namespace tessera
