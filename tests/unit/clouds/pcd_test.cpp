// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// PCD files come out as they were written, whatever their fields and their storage.
#include <catch2/catch.hpp>
#include <cmath>

#include "sample_clouds.hpp"
#include "scans/lzf.hpp"
#include "scans/pcd_reader.hpp"

namespace tessera {
namespace {

using namespace test;

using Floats = std::vector<float>;
using Ids = std::vector<std::int64_t>;

TEST_CASE("pcd: ascii points, in any order of fields") {
  PcdLines lines;
  lines.fields = "label z rgb y x";
  lines.sizes = "4 4 4 4 4";
  lines.types = "U F F F F";
  lines.counts = "1 1 1 1 1";
  const Read read = read_as_pcd(pcd_header(lines) + "40 3 0 2 1\n\n 50 -6 0 +5.5 4e0");
  REQUIRE(read.failure == "");
  CHECK(coordinates(read.cloud) == Floats{1, 2, 3, 4, 5.5F, -6});
  CHECK(read.cloud.raw_ids == Ids{40, 50});
}

TEST_CASE("pcd: lines may end with CR LF") {
  std::string file = pcd_header({}) + "1 2 3\n4 5 6\n";
  for (std::size_t at = 0; (at = file.find('\n', at)) != std::string::npos; at += 2)
    file.insert(at, 1, '\r');
  const Read read = read_as_pcd(file);
  REQUIRE(read.failure == "");
  CHECK(coordinates(read.cloud) == Floats{1, 2, 3, 4, 5, 6});
}

/// Two points with every type there is, more numbers than one in a field, and padding.
PcdLines many_types() {
  PcdLines lines;
  lines.fields = "intensity normal x _ y z class stamp";
  lines.sizes = "1 4 8 1 4 2 1 8";
  lines.types = "U F F U F I I U";
  lines.counts = "1 3 1 3 1 1 1 1";
  return lines;
}

std::string record(std::uint8_t intensity, double x, float y, std::int16_t z, std::int8_t id) {
  return bytes_of(intensity) + std::string(12, 'n') + bytes_of(x) + "___" + bytes_of(y) +
         bytes_of(z) + bytes_of(id) + std::string(8, 's');
}

void check_many_types(const Read& read) {
  REQUIRE(read.failure == "");
  CHECK(read.cloud.points_xyzi == Floats{1.25F, 2.5F, -3, 7, -1000.5F, 0, 300, 255});
  CHECK(read.cloud.raw_ids == Ids{70, -1});
}

TEST_CASE("pcd: binary records of all types, with fields of several numbers") {
  PcdLines lines = many_types();
  lines.data = "binary";
  check_many_types(read_as_pcd(pcd_header(lines) + record(7, 1.25, 2.5F, -3, 70) +
                               record(255, -1000.5, 0.0F, 300, -1)));
}

TEST_CASE("pcd: compressed points, a field after the other") {
  PcdLines lines = many_types();
  lines.data = "binary_compressed";
  const std::string a = record(7, 1.25, 2.5F, -3, 70);
  const std::string b = record(255, -1000.5, 0.0F, 300, -1);
  std::string payload;
  std::size_t at = 0;
  for (const std::size_t bytes : {1U, 12U, 8U, 3U, 4U, 2U, 1U, 8U}) {
    payload += a.substr(at, bytes) + b.substr(at, bytes);
    at += bytes;
  }
  REQUIRE(at == a.size());
  check_many_types(read_as_pcd(pcd_header(lines) + compressed(payload)));
}

TEST_CASE("pcd: many compressed points come back") {
  PcdLines lines;
  lines.points = lines.width = "30000";
  lines.data = "binary_compressed";
  std::string payload;
  Floats expected(90000);
  for (std::size_t part = 0; part < 3; ++part) {
    for (std::size_t i = 0; i < 30000; ++i) {
      expected[3 * i + part] = static_cast<float>(i / 7) * (part == 1 ? -0.25F : 0.5F);
      payload += bytes_of(expected[3 * i + part]);
    }
  }
  const Read read = read_as_pcd(pcd_header(lines) + compressed(payload));
  REQUIRE(read.failure == "");
  CHECK(coordinates(read.cloud) == expected);
}

TEST_CASE("pcd: where nothing came back an organised cloud has no point") {
  PcdLines lines;
  lines.width = "2";
  lines.height = "2";
  lines.points = "4";
  const Read read = read_as_pcd(pcd_header(lines) + "1 2 3\nnan nan nan\nNaN 5 6\n-nan nan nan\n");
  REQUIRE(read.failure == "");
  REQUIRE(read.cloud.num_points() == 2);
  CHECK(std::isnan(read.cloud.points_xyzi[4]));
}

TEST_CASE("pcd: NaN in a plain list of points is left to the map, which counts it") {
  const Read read = read_as_pcd(pcd_header({}) + "1 2 3\nnan nan nan\n");
  REQUIRE(read.failure == "");
  CHECK(read.cloud.num_points() == 2);
}

TEST_CASE("pcd: labels as whole floats, and label before class") {
  PcdLines lines;
  lines.fields = "class x y z label";
  lines.sizes = "4 4 4 4 4";
  lines.types = "F F F F F";
  lines.counts = "1 1 1 1 1";
  const Read read = read_as_pcd(pcd_header(lines) + "0.5 1 2 3 40.0\n0.5 1 2 3 9e0\n");
  REQUIRE(read.failure == "");
  CHECK(read.cloud.raw_ids == Ids{40, 9});
}

TEST_CASE("pcd: an old header without COUNT and POINTS, and no points at all") {
  const std::string file =
      "VERSION .5\nCOLUMNS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 0\nHEIGHT 1\nDATA ascii";
  const Read read = read_as_pcd(file);
  REQUIRE(read.failure == "");
  CHECK(read.cloud.num_points() == 0);
  CHECK(read.cloud.raw_ids.empty());
}

TEST_CASE("pcd: the header alone tells points, labels and viewpoint") {
  PcdLines lines;
  lines.fields = "x y z semantic";
  lines.sizes = "4 4 4 2";
  lines.types = "F F F U";
  lines.counts = "1 1 1 1";
  lines.viewpoint = "0 0 1.7 1 0 0 0";
  lines.data = "binary";
  const std::string header = pcd_header(lines);
  const Outcome<CloudSummary> summary = inspect_pcd({"a.pcd", header}, header.size() + 28);
  REQUIRE(summary.ok());
  CHECK(summary->points == 2);
  CHECK(summary->has_labels);
  CHECK(summary->has_viewpoint);
  CHECK_FALSE(inspect_pcd({"a.pcd", header}, header.size() + 27).ok());
}

TEST_CASE("lzf: literals and references by hand") {
  // "abc", then 6 bytes from 3 back; then 264 of the last byte by the long form.
  const std::string packed(
      "\x02"
      "abc\x80\x02\xe0\xff\x00",
      9);
  std::string out(3 + 6 + 264, '\0');
  REQUIRE(decompress_lzf(packed, out));
  CHECK(out == "abcabcabc" + std::string(264, 'c'));
  CHECK(lzf_most_bytes(packed.size()) >= out.size());
  std::string shorter(out.size() - 1, '\0');
  CHECK_FALSE(decompress_lzf(packed, shorter));
  std::string longer(out.size() + 1, '\0');
  CHECK_FALSE(decompress_lzf(packed, longer));
}

TEST_CASE("lzf: a reference before the beginning and an end within a run are damage") {
  std::string out(8, '\0');
  CHECK_FALSE(decompress_lzf(std::string("\x00"
                                         "a\x80\x07",
                                         4),
                             out));
  CHECK_FALSE(decompress_lzf(std::string("\x07"
                                         "abc",
                                         4),
                             out));
  CHECK_FALSE(decompress_lzf("", out));
}

}  // namespace
}  // namespace tessera
