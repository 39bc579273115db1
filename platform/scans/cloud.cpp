// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "scans/cloud.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <utility>

#include "base/input_file.hpp"

namespace tessera {
namespace {

/// Reads the file up to most_bytes.
Outcome<CloudHead> read_up_to(const std::string& path, std::uint64_t most_bytes) {
  TESSERA_TRY_ASSIGN(InputFile file, InputFile::open(path));
  if (file.size_bytes() > kMostCloudFileBytes) {
    return cloud_failure(path, fmt::format("{} bytes, the limit is 2 GiB", file.size_bytes()),
                         "split it into several scans");
  }
  CloudHead head{.path = path, .bytes = {}, .file_bytes = file.size_bytes()};
  head.bytes.resize(static_cast<std::size_t>(std::min(file.size_bytes(), most_bytes)));
  TESSERA_TRY(file.read_exactly(std::as_writable_bytes(std::span(head.bytes))));
  return head;
}

}  // namespace

std::string printable(std::string_view text) {
  std::string shown(text.substr(0, 32));
  for (char& letter : shown) {
    if (letter < ' ' || letter > '~') letter = '?';
  }
  return shown;
}

Failure cloud_failure(std::string_view path, std::string_view what, std::string_view remedy) {
  std::string message(path);
  message.append(": ").append(one_line(what)).append("; ").append(remedy);
  return {std::move(message)};
}

Failure too_many_points(std::string_view path, std::uint64_t points) {
  return cloud_failure(path, fmt::format("{} points, the limit is {}", points, kMostCloudPoints),
                       "split it into several scans");
}

Outcome<CloudHead> read_cloud_head(const std::string& path) {
  return read_up_to(path, kMostCloudHeaderBytes + kPcdSizesBytes);
}

Outcome<std::string> read_cloud_bytes(const std::string& path) {
  TESSERA_TRY_ASSIGN(CloudHead all, read_up_to(path, kMostCloudFileBytes));
  return std::move(all.bytes);
}

}  // namespace tessera
