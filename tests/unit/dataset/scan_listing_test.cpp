// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "scans/scan_listing.hpp"

#include <catch2/catch.hpp>

#include "support/temporary_folder.hpp"

namespace tessera {
namespace {

using Catch::Matchers::Contains;

TEST_CASE("list_scans: ascending, and other names are passed over") {
  const test::TemporaryFolder folder;
  for (const char* name : {"000010.bin", "000002.bin", "999999.bin", "12345.bin", "0000001.bin",
                           "00000a.bin", "000003.txt", "-00004.bin", "000005.bin.part"}) {
    folder.write(name, "");
  }
  const Outcome<std::vector<int>> scans = list_scans(folder.path().string());
  REQUIRE(scans.ok());
  CHECK(*scans == std::vector<int>{2, 10, 999999});
}

TEST_CASE("list_scans: a folder that cannot be listed is named") {
  const test::TemporaryFolder folder;
  CHECK_THAT(list_scans(folder.file("no")).failure().text(),
             Contains("cannot list " + folder.file("no")) && Contains("check the name"));
}

TEST_CASE("missing_scans: gaps inside and at both ends of the range") {
  const std::vector<int> scans{3, 4, 7, 9};
  CHECK(missing_scans(scans, {3, 4}).empty());
  CHECK(to_text(missing_scans(scans, {3, 9})) == "5-6, 8");
  CHECK(to_text(missing_scans(scans, {0, 12})) == "0-2, 5-6, 8, 10-12");
  CHECK(to_text(missing_scans(scans, {5, 6})) == "5-6");
}

TEST_CASE(
    "ScanFilePath: six digits, relative folders inside the dataset, absolute ones as they are") {
  CHECK(ScanFilePath("data", "velodyne", 42, ".bin").view() == "data/velodyne/000042.bin");
  CHECK(ScanFilePath("data", "/else/where", 999999, ".label").view() == "/else/where/999999.label");
}

TEST_CASE(
    "ScanFilePath: a path that is too long is refused as such, not cut to another file's name") {
  const ScanFilePath path(std::string(5000, 'x'), "velodyne", 0, ".bin");
  CHECK_THAT(InputFile::open(path.view()).failure().text(), Contains("shorter path"));
  CHECK_THAT(file_size_bytes(path).failure().text(), Contains("shorter path"));
}

}  // namespace
}  // namespace tessera
