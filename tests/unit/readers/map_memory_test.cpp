// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Map files, OctoMap's files and KITTI's scans take what docs/reference/formats.md says.
#include <catch2/catch.hpp>
#include <cstring>
#include <string>

#include "maps/octree_reader.hpp"
#include "maps/stored_map.hpp"
#include "scans/dataset.hpp"
#include "support/heap_peak.hpp"
#include "support/reader_memory.hpp"
#include "support/temporary_folder.hpp"

namespace tessera {
namespace {

using test::HeapPeak;
using test::TemporaryFolder;

TEST_CASE("reader memory: a tree of OctoMap takes its file") {
  const std::string header = "# Octomap OcTree binary file\nid OcTree\nsize 60001\nres 0.1\ndata\n";
  const TemporaryFolder folder;
  for (const std::string& tree : {std::string(120'000, '\xff'), std::string(120'000, '\0')}) {
    folder.write("a.bt", header + tree);
    const std::string path = folder.file("a.bt");
    const HeapPeak peak;
    static_cast<void>(Octree::read(path).ok());
    CHECK(peak.bytes() <= test::octree_bytes(header.size() + tree.size()));
  }
}

TEST_CASE("reader memory: scans of KITTI take 17 bytes a point of 16 bytes of file") {
  const TemporaryFolder folder;
  constexpr std::size_t kPoints = 100'000;
  folder.write("velodyne/000000.bin", std::string(kPoints * 16, '\0'));
  folder.write("predictions/000000.label", std::string(kPoints * 4, '\0'));
  folder.write("poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n");
  folder.write("calib.txt", "Tr: 1 0 0 0 0 1 0 0 0 0 1 0\n");
  const HeapPeak peak;
  const Outcome<Dataset> dataset = Dataset::open(folder.path().string());
  REQUIRE(dataset.ok());
  Outcome<ScanReader> reader = ScanReader::make(*dataset);
  REQUIRE(reader.ok());
  REQUIRE(reader->read(0).ok());
  // The classes' table of raw ids has less than 512 KiB while it is made.
  CHECK(peak.bytes() <= 17 * kPoints + 8 * test::kSmallBytes);
}

TEST_CASE("reader memory: a map file is refused before its header's claim is taken") {
  const TemporaryFolder folder;
  for (const std::string& file :
       {std::string(3'000, '\0'), "TESSERA\n" + std::string(3'000, '\xff')}) {
    folder.write("a.tsm", file);
    const HeapPeak peak;
    CHECK_FALSE(load_map(folder.file("a.tsm")).ok());
    CHECK(peak.bytes() <= sizeof(MapFileBuffer) + test::kSmallBytes);
  }
}

}  // namespace
}  // namespace tessera
