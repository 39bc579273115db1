// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "scans/scan_listing.hpp"

#include <fmt/core.h>
#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <system_error>

#include "base/system_failure.hpp"

namespace tessera {
namespace {

constexpr std::size_t kDigits = 6;
constexpr std::string_view kScanExtension = ".bin";

std::optional<int> scan_number_of(std::string_view name) {
  if (name.size() != kDigits + kScanExtension.size() || !name.ends_with(kScanExtension)) {
    return std::nullopt;
  }
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  const std::string_view digits = name.substr(0, kDigits);
  if (!std::all_of(digits.begin(), digits.end(), is_digit)) return std::nullopt;
  int number = 0;
  std::from_chars(digits.data(), digits.data() + kDigits, number);
  return number;
}

}  // namespace

ScanFilePath::ScanFilePath(std::string_view dataset, std::string_view folder, int scan_number,
                           std::string_view extension) noexcept {
  std::array<char, 16> name{};
  const int name_bytes = std::snprintf(name.data(), name.size(), "%06d", scan_number);
  const auto append = [this](std::string_view part) {
    const std::size_t count = std::min(part.size(), text_.size() - 1 - length_);
    std::copy_n(part.begin(), count, text_.begin() + static_cast<std::ptrdiff_t>(length_));
    length_ += count;
  };
  if (!folder.starts_with('/')) {
    append(dataset);
    append("/");
  }
  append(folder);
  append("/");
  append({name.data(), static_cast<std::size_t>(name_bytes)});
  append(extension);
}

std::string in_folder(const std::string& dir, const std::string& name) {
  return (std::filesystem::path(dir) / name).string();
}

Outcome<std::vector<int>> list_scans(const std::string& folder) {
  std::error_code error;
  std::filesystem::directory_iterator files(folder, error);
  std::vector<int> numbers;
  while (!error && files != std::filesystem::directory_iterator()) {
    const std::string name = files->path().filename().string();
    if (const std::optional<int> number = scan_number_of(name)) {
      if (!files->is_regular_file()) {
        return Failure{"cannot read " + files->path().string() +
                       ": it is not a regular file; put the scan's file in its place"};
      }
      numbers.push_back(*number);
    }
    files.increment(error);
  }
  if (error) return system_failure("list", folder, error.value(), FailureKind::kUsage);
  if (numbers.empty()) {
    return Failure{"there are no scans in " + folder + "; name them 000000.bin, 000001.bin, ..."};
  }
  std::sort(numbers.begin(), numbers.end());
  return numbers;
}

std::vector<ScanRange> missing_scans(const std::vector<int>& scans, ScanRange range) {
  std::vector<ScanRange> missing;
  int expected = range.first;
  for (const int number : scans) {
    if (number < range.first || number > range.last) continue;
    if (number > expected) missing.push_back({expected, number - 1});
    expected = number + 1;
  }
  if (expected <= range.last) missing.push_back({expected, range.last});
  return missing;
}

std::string to_text(const std::vector<ScanRange>& ranges) {
  std::string text;
  for (const ScanRange& range : ranges) {
    if (!text.empty()) text.append(", ");
    text.append(std::to_string(range.first));
    if (range.last != range.first) text.append("-").append(std::to_string(range.last));
  }
  return text;
}

bool is_file(const ScanFilePath& path) noexcept {
  struct stat status {};
  return ::stat(path.c_str(), &status) == 0 && S_ISREG(status.st_mode);
}

Outcome<std::uint64_t> file_size_bytes(const ScanFilePath& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) {
    return system_failure("read", path.view(), errno, FailureKind::kUsage);
  }
  if (!S_ISREG(status.st_mode)) {
    return Failure{"cannot read " + std::string(path.view()) +
                   ": it is not a regular file; put the scan's file in its place"};
  }
  return static_cast<std::uint64_t>(status.st_size);
}

Outcome<InputFile> open_unchanged(const ScanFilePath& path, std::uint64_t expected_bytes) {
  Outcome<InputFile> file = InputFile::open(path.view());
  if (!file.ok()) return Failure{file.failure().message, FailureKind::kFailure};
  if (file->size_bytes() == expected_bytes) return file;
  return Failure{fmt::format("{} has {} bytes, but had {} when the dataset was opened; do not "
                             "change its files during a run",
                             path.view(), file->size_bytes(), expected_bytes),
                 FailureKind::kFailure};
}

}  // namespace tessera
