// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "sample_clouds.hpp"

#include <lzf.h>

#include "scans/pcd_reader.hpp"
#include "scans/ply_reader.hpp"

namespace tessera::test {

std::string pcd_header(const PcdLines& lines) {
  std::string header = "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\n";
  const auto line = [&header](std::string_view word, std::string_view value) {
    header.append(word).append(" ").append(value).append("\n");
  };
  line("FIELDS", lines.fields);
  line("SIZE", lines.sizes);
  line("TYPE", lines.types);
  line("COUNT", lines.counts);
  line("WIDTH", lines.width);
  line("HEIGHT", lines.height);
  line("VIEWPOINT", lines.viewpoint);
  line("POINTS", lines.points);
  line("DATA", lines.data);
  return header;
}

std::string compressed(const std::string& payload) {
  std::string out(payload.size() * 2 + 64, '\0');
  const unsigned size = ::lzf_compress(payload.data(), static_cast<unsigned>(payload.size()),
                                       out.data(), static_cast<unsigned>(out.size()));
  out.resize(size);
  return bytes_of(size) + bytes_of(static_cast<std::uint32_t>(payload.size())) + out;
}

Read read_as_pcd(const std::string& file) {
  Read read;
  const Outcome<void> outcome = read_pcd({"a.pcd", file}, read.cloud);
  if (!outcome.ok()) read.failure = outcome.failure().text();
  return read;
}

Read read_as_ply(const std::string& file) {
  Read read;
  const Outcome<void> outcome = read_ply({"a.ply", file}, read.cloud);
  if (!outcome.ok()) read.failure = outcome.failure().text();
  return read;
}

std::vector<float> coordinates(const Cloud& cloud) {
  std::vector<float> all;
  for (std::size_t i = 0; i < cloud.points_xyzi.size(); ++i) {
    if (i % 4 != 3) all.push_back(cloud.points_xyzi[i]);
  }
  return all;
}

}  // namespace tessera::test
