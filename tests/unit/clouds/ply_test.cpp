// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// PLY files of every format come out as they were written; what cannot be what it says is refused.
#include <catch2/catch.hpp>

#include "sample_clouds.hpp"
#include "scans/ply_reader.hpp"

namespace tessera {
namespace {

using namespace test;
using Catch::Matchers::Contains;
using Catch::Matchers::StartsWith;

using Floats = std::vector<float>;
using Ids = std::vector<std::int64_t>;

/// Elements before and after the vertices, lists in all of them, every size of number.
std::string header(const std::string& format, const std::string& vertices = "2") {
  return "ply\nformat " + format +
         " 1.0\ncomment by hand\nelement camera 1\nproperty list uchar double pose\nproperty char "
         "id\n"
         "element nothing 1000000000000\nelement vertex " +
         vertices +
         "\nproperty uchar intensity\nproperty double z\nproperty list ushort short rings\n"
         "property float x\nproperty int16 y\nproperty uint label\nobj_info none\n"
         "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
}

const std::string kAscii = "2 0.5 0.25 7\n5 -3 0 1.5 2 40\n255 6 3 7 8 9 4.25 -5 65586\n3 0 1 0\n";

std::string binary(bool big) {
  const auto vertex = [big](std::uint8_t intensity, double z, std::vector<std::int16_t> rings,
                            float x, std::int16_t y, std::uint32_t label) {
    std::string bytes = bytes_of(intensity) + bytes_of(z, big) +
                        bytes_of(static_cast<std::uint16_t>(rings.size()), big);
    for (const std::int16_t ring : rings) bytes += bytes_of(ring, big);
    return bytes + bytes_of(x, big) + bytes_of(y, big) + bytes_of(label, big);
  };
  return std::string("\2") + bytes_of(0.5, big) + bytes_of(0.25, big) + "\7" +
         vertex(5, -3.0, {}, 1.5F, 2, 40) + vertex(255, 6.0, {7, 8, 9}, 4.25F, -5, 65586) + "\3" +
         bytes_of(std::int32_t{3}, big) + bytes_of(std::int32_t{1}, big) +
         bytes_of(std::int32_t{0}, big);
}

void check_two(const Read& read) {
  REQUIRE(read.failure == "");
  CHECK(read.cloud.points_xyzi == Floats{1.5F, 2, -3, 5, 4.25F, -5, 6, 255});
  CHECK(read.cloud.raw_ids == Ids{40, 65586});
}

std::string refusal_of(const std::string& file) {
  const std::string message = read_as_ply(file).failure;
  CHECK_THAT(message, StartsWith("a.ply"));
  CHECK(message.find('\n') == std::string::npos);
  CHECK_THAT(message, Contains("; "));
  return message;
}

TEST_CASE("ply: ascii, between other elements and with lists") {
  check_two(read_as_ply(header("ascii") + kAscii));
}

TEST_CASE("ply: binary of both byte orders") {
  check_two(read_as_ply(header("binary_little_endian") + binary(false) + "the rest is not read"));
  check_two(read_as_ply(header("binary_big_endian") + binary(true)));
}

TEST_CASE("ply: without labels there are none, and the header tells so") {
  const std::string file =
      "ply\r\nformat ascii 1.0\r\nelement vertex 1\r\nproperty float x\r\nproperty float y\r\n"
      "property float z\r\nend_header\r\n1 2 3\r\n";
  const Read read = read_as_ply(file);
  REQUIRE(read.failure == "");
  CHECK(read.cloud.points_xyzi == Floats{1, 2, 3, 0});
  CHECK(read.cloud.raw_ids.empty());
  const Outcome<CloudSummary> summary = inspect_ply({"a.ply", file}, file.size());
  REQUIRE(summary.ok());
  CHECK(summary->points == 1);
  CHECK_FALSE(summary->has_labels);
}

TEST_CASE("ply: malformed headers are refused with what is wrong") {
  const std::string good = header("ascii");
  const auto changed = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    text.replace(text.find(from), from.size(), to);
    return refusal_of(text + kAscii);
  };
  CHECK_THAT(refusal_of(""), Contains("first line is not ply"));
  CHECK_THAT(refusal_of("ply of another kind\n"), Contains("first line is not ply"));
  CHECK_THAT(changed("ascii 1.0", "ascii 2.0"), Contains("line 2: the format is not ascii"));
  CHECK_THAT(changed("ascii 1.0", "binary 1.0"), Contains("line 2: the format is not ascii"));
  CHECK_THAT(changed("format ascii 1.0\n", ""), Contains("has no format line"));
  CHECK_THAT(changed("vertex 2", "vertex -2"),
             Contains("line 8: an element has no name and count"));
  CHECK_THAT(changed("element face", "element vertex"), Contains("duplicate element vertex"));
  CHECK_THAT(changed("element vertex", "element point"), Contains("no element vertex"));
  CHECK_THAT(changed("float x", "half x"), Contains("a property has no type and name"));
  CHECK_THAT(changed("list ushort", "list float"), Contains("a property has no type and name"));
  CHECK_THAT(changed("float x", "float w"), Contains("no field x"));
  CHECK_THAT(changed("float x", "list uchar float x"), Contains("no field x"));
  CHECK_THAT(changed("uchar intensity", "uchar z"), Contains("duplicate field z"));
  CHECK_THAT(changed("obj_info", "objinfo"), Contains("unknown keyword 'objinfo'"));
  CHECK_THAT(changed("vertex 2", "vertex 16777217"), Contains("the limit is 16777216"));
  CHECK_THAT(changed("camera 1", "camera 18446744073709551615"), Contains("element camera"));
  for (std::size_t bytes = 0; bytes + 1 < good.size(); ++bytes) refusal_of(good.substr(0, bytes));
}

TEST_CASE("ply: every truncation of binary vertices is refused") {
  for (const bool big : {false, true}) {
    const std::string start = header(big ? "binary_big_endian" : "binary_little_endian");
    const std::string payload = binary(big);
    for (std::size_t bytes = 0; bytes < payload.size(); ++bytes)
      refusal_of(start + payload.substr(0, bytes));
  }
}

TEST_CASE("ply: rows that are none") {
  const std::string start = header("ascii", "1") + "1 0.5 7\n";
  CHECK_THAT(refusal_of(start + "5 -3 0 1.5 2 40 1\n"),
             Contains("line 20: the row does not have the numbers"));
  CHECK_THAT(refusal_of(start + "5 -3 0 1.5 2\n\n"),
             Contains("line 20: the row does not have the numbers"));
  CHECK_THAT(refusal_of(start + "5 -3 99999999999 1.5 2 40\n"), Contains("line 20"));
  CHECK_THAT(refusal_of(start + "5 -3 -1 1.5 2 40\n"), Contains("line 20"));
  CHECK_THAT(refusal_of(start + "5 -3 0 one 2 40\n"), Contains("line 20: a word is not a number"));
  CHECK_THAT(refusal_of(start + "5 -3 0 1.5 2 4.5\n"), Contains("line 20: the label"));
  CHECK_THAT(refusal_of(header("ascii") + "1 0.50000000000000000 7\n5 -3 0 1.5 2 40\n"),
             Contains("it ends before the element vertex number 1"));
}

TEST_CASE("ply: more vertices than the header says are no other element") {
  const std::string vertices =
      "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty "
      "float y\nproperty float z\nend_header\n";
  CHECK(read_as_ply(vertices + "1 2 3\n \r\n\n").failure == "");
  CHECK_THAT(refusal_of(vertices + "1 2 3\n4 5 6\n"), Contains("continues after the last element"));
  CHECK_THAT(refusal_of(header("ascii", "1") + kAscii),
             Contains("the row does not have the numbers"));
  // A vertex taken for a face is refused for whatever its bytes say then, but is.
  CHECK_FALSE(refusal_of(header("binary_little_endian", "1") + binary(false)).empty());
  for (const char* const face : {"3 0 1", "3 0 1 0 7", "3 0 one 0 2"})
    CHECK_THAT(refusal_of(header("ascii") + kAscii.substr(0, kAscii.find("3 0 1 0")) + face + "\n"),
               Contains("the row does not have the numbers"));
  CHECK_THAT(refusal_of(header("binary_little_endian") + binary(false) + std::string(30, '\1')),
             Contains("continues after the last element"));
  CHECK(read_as_ply(header("binary_little_endian") + binary(false) + "\n").failure == "");
}

TEST_CASE("ply: counts that lie are refused, and nothing is allocated for them") {
  for (const char* const format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    const std::string file = header(format, "16777216") + std::string(64, '\0');
    Cloud cloud;
    CHECK_FALSE(read_ply({"a.ply", file}, cloud).ok());
    CHECK(cloud.points_xyzi.capacity() == 0);
  }
}

TEST_CASE("ply: what is of the other byte order than its header says") {
  CHECK_THAT(refusal_of(header("binary_big_endian") + binary(false)), Contains("other byte order"));
  std::string vertices;
  for (int i = 1; i <= 24; ++i) vertices += bytes_of(0.37F * static_cast<float>(i));
  const std::string rest =
      " 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
  CHECK(read_as_ply("ply\nformat binary_little_endian" + rest + vertices).failure == "");
  CHECK_THAT(refusal_of("ply\nformat binary_big_endian" + rest + vertices),
             Contains("other byte order"));
  std::string wide;
  for (int i = 1; i <= 24; ++i) wide += bytes_of(0.37 * i, true);
  const std::string doubles =
      " 1.0\nelement vertex 8\nproperty double x\nproperty double y\nproperty double "
      "z\nend_header\n";
  CHECK(read_as_ply("ply\nformat binary_big_endian" + doubles + wide).failure == "");
  CHECK_THAT(refusal_of("ply\nformat binary_little_endian" + doubles + wide),
             Contains("other byte order"));
}

}  // namespace
}  // namespace tessera
