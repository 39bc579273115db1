// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Text files take what docs/reference/formats.md says: poses, and TOML of many small tables.
#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "scans/cameras_toml.hpp"
#include "scans/dataset_classes.hpp"
#include "scans/pose_file.hpp"
#include "scans/poses.hpp"
#include "support/heap_peak.hpp"
#include "support/reader_memory.hpp"
#include "support/temporary_folder.hpp"

namespace tessera {
namespace {

using test::HeapPeak;
using test::TemporaryFolder;

std::string repeated(std::string_view text, std::size_t count) {
  std::string all;
  for (std::size_t i = 0; i < count; ++i) all += text;
  return all;
}

template <class Call>
std::size_t peak_of(const Call& call) {
  const HeapPeak peak;
  static_cast<void>(call().ok());
  return peak.bytes();
}

TEST_CASE("reader memory: poses, in a multiple of their file's size") {
  const TemporaryFolder folder;
  const std::string path = folder.file("poses.txt");
  const std::string square = "1 0 0 0 0 1 0 0 0 0 1 0\n";
  for (const std::string& text :
       {repeated(square, 40'000), repeated("0 0 0 0 0 0 0 0\n", 1), repeated("\n", 500'000),
        square + repeated("#--------------\n", 40'000), repeated(square, 32'769)}) {
    folder.write("poses.txt", text);
    const std::size_t most = test::poses_bytes(text.size());
    CHECK(peak_of([&] { return read_poses(path); }) <= most);
    CHECK(peak_of([&] { return read_pose_rows(path); }) <= most);
  }
  std::string tum;
  for (int i = 0; i < 40'000; ++i) tum.append(std::to_string(i)).append(" 0 0 0 0 0 0 1\n");
  folder.write("poses.txt", tum);
  REQUIRE(read_pose_rows(path).ok());
  CHECK(peak_of([&] { return read_pose_rows(path); }) <= test::poses_bytes(tum.size()));
}

/// Texts of many small parts, of about so many bytes each.
std::vector<std::string> many_parts(std::size_t bytes) {
  std::string tables;
  for (std::size_t i = 0; tables.size() < bytes; ++i)
    tables.append("[").append(std::to_string(i)).append("]\n");
  std::string keys;
  for (std::size_t i = 0; keys.size() < bytes; ++i) keys.append(std::to_string(i)).append("=0\n");
  std::string dots;
  for (std::size_t i = 0; dots.size() < bytes; ++i)
    dots.append("[").append(std::to_string(i)).append(repeated(".a", 200)).append("]\n");
  const auto list = [](std::string_view entry, std::size_t count) {
    return std::string("a=[").append(repeated(entry, count)).append("]");
  };
  return {tables,
          keys,
          dots,
          std::string("[a").append(repeated(".a", 3'900)).append("]\n"),
          list("0,", bytes / 2),
          list("[],", bytes / 3),
          list("{},", bytes / 3),
          list("{a=0},", bytes / 6),
          list("\"\",", bytes / 3),
          repeated("[[a]]\n", bytes / 6),
          repeated("\xff", bytes),
          std::string("a=\"").append(bytes, 'b').append("\""),
          repeated("[", 100'000)};
}

TEST_CASE("reader memory: TOML of many small parts, in a multiple of its size") {
  for (const std::string& text : many_parts(200'000)) {
    INFO(text.substr(0, 40));
    const std::size_t most = test::toml_bytes(text.size());
    for (const std::size_t bytes :
         {peak_of([&] { return DatasetClasses::parse(text, "classes.toml"); }),
          peak_of([&] { return parse_cameras(text, "cameras.toml"); }),
          peak_of([&] { return parse_depth_camera(text, "camera.toml"); })}) {
      CHECK(bytes <= most);
    }
  }
}

}  // namespace
}  // namespace tessera
