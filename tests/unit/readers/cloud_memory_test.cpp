// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Clouds take what docs/reference/formats.md says, whatever their headers do.
#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "scans/cloud_folder.hpp"
#include "scans/pcd_reader.hpp"
#include "scans/ply_reader.hpp"
#include "support/heap_peak.hpp"
#include "support/reader_memory.hpp"
#include "support/temporary_folder.hpp"
#include "unit/clouds/sample_clouds.hpp"

namespace tessera {
namespace {

using test::compressed;
using test::HeapPeak;
using test::pcd_header;
using test::PcdLines;
using test::TemporaryFolder;

std::size_t peak_of(Outcome<void> (*read)(const CloudBytes&, Cloud&), const std::string& file,
                    bool is_fine) {
  const HeapPeak peak;
  bool done = false;
  {
    Cloud cloud;
    done = read({"a.cloud", file}, cloud).ok();
  }
  const std::size_t bytes = peak.bytes();
  CHECK(done == is_fine);
  return bytes;
}

std::string repeated(std::string_view text, std::size_t count) {
  std::string all;
  for (std::size_t i = 0; i < count; ++i) all += text;
  return all;
}

/// 30,000 points of three bytes each, the smallest that there are.
std::string smallest_points(std::string_view data) {
  PcdLines lines{.sizes = "1 1 1", .types = "I I I", .width = "30000", .points = "30000"};
  lines.data = data;
  const std::string payload = repeated("\1\2\3", 30'000);
  if (data == "ascii") return pcd_header(lines) + repeated("1 2 3\n", 30'000);
  return pcd_header(lines) + (data == "binary" ? payload : compressed(payload));
}

TEST_CASE("reader memory: points of a PCD file, in a multiple of its size") {
  for (const char* data : {"ascii", "binary"}) {
    const std::string file = smallest_points(data);
    CHECK(peak_of(read_pcd, file, true) <= test::cloud_bytes(file.size()));
  }
  const std::string packed = smallest_points("binary_compressed");
  CHECK(peak_of(read_pcd, packed, true) <= test::packed_cloud_bytes(packed.size()));
}

TEST_CASE("reader memory: headers of many fields") {
  const std::string ones = repeated("1 ", 8'000);
  const std::string types = repeated("I ", 8'000);
  PcdLines lines{.fields = ones, .sizes = ones, .types = types, .counts = ones};
  const std::string pcd = pcd_header(lines);
  CHECK(peak_of(read_pcd, pcd, false) <= test::cloud_header_bytes(pcd.size()));
  const std::string blanks = "FIELDS " + repeated("1 ", 32'700) + "\n";
  CHECK(peak_of(read_pcd, blanks, false) <= test::cloud_header_bytes(blanks.size()));
  const std::string start = "ply\nformat ascii 1.0\n";
  std::string elements = start;
  for (int i = 0; i < 4'000; ++i) elements += "element " + std::to_string(i) + " 0\n";
  const std::string properties =
      start + "element vertex 0\n" + repeated("property char a\n", 4'000);
  for (const std::string& ply : {elements, properties, properties + "end_header\n"})
    CHECK(peak_of(read_ply, ply, false) <= test::cloud_header_bytes(ply.size()));
}

TEST_CASE("reader memory: points of a PLY file, in a multiple of its size") {
  const std::string start = "ply\nformat binary_little_endian 1.0\nelement vertex 30000\n";
  const std::string names = "property char x\nproperty char y\nproperty char z\nend_header\n";
  const std::string file = start + names + repeated("\1\2\3", 30'000);
  CHECK(peak_of(read_ply, file, true) <= test::cloud_bytes(file.size()));
}

/// Compressed points of a MiB for each 12 KB of file, read as a folder's scan.
struct Packed {
  explicit Packed(std::size_t points) {
    PcdLines lines{
        .fields = "x y z w", .sizes = "4 4 4 4", .types = "F F F F", .counts = "1 1 1 5"};
    const std::string count = std::to_string(points);
    lines.width = lines.points = count;
    lines.data = "binary_compressed";
    folder.write("clouds/0.pcd", pcd_header(lines) + compressed(std::string(points * 32, '\0')));
    folder.write("poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n");
    options.poses = folder.file("poses.txt");
  }
  TemporaryFolder folder;
  CloudOptions options;
};

TEST_CASE("reader memory: compressed points take 512 MiB in all, unpacked and as a scan") {
  constexpr std::size_t kMost = std::size_t{512} << 20U;
  constexpr std::size_t kPoints = kMost / (32 + kScanPointBytes);
  const Packed fitting(kPoints);
  std::size_t peak_bytes = 0;
  {
    const HeapPeak peak;
    const Outcome<CloudFolder> clouds =
        CloudFolder::open(fitting.folder.file("clouds"), fitting.options);
    REQUIRE(clouds.ok());
    Outcome<ScanReader> reader = ScanReader::make(*clouds);
    REQUIRE(reader.ok());
    const Outcome<ScanView> scan = reader->read(0);
    REQUIRE(scan.ok());
    CHECK(scan->count == kPoints);
    peak_bytes = peak.bytes();
  }
  const std::size_t file = fitting.folder.read("clouds/0.pcd").size();
  CHECK(peak_bytes <= kMost + file + (std::size_t{1} << 20U));
  const Packed larger(kPoints + 1);
  const HeapPeak peak;
  const Outcome<CloudFolder> refused =
      CloudFolder::open(larger.folder.file("clouds"), larger.options);
  const std::size_t refused_bytes = peak.bytes();
  CHECK_FALSE(refused.ok());
  CHECK(refused_bytes <= std::size_t{1} << 20U);
}

}  // namespace
}  // namespace tessera
