// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// PCD files that cannot be what they say: one line that names the file, and no memory for claims.
#include <catch2/catch.hpp>

#include "sample_clouds.hpp"
#include "scans/pcd_reader.hpp"

namespace tessera {
namespace {

using namespace test;
using Catch::Matchers::Contains;
using Catch::Matchers::StartsWith;

const std::string kTwoPoints = "1 2 3\n4 5 6\n";

std::string refusal_of(const std::string& file) {
  const std::string message = read_as_pcd(file).failure;
  CHECK_THAT(message, StartsWith("a.pcd"));
  CHECK(message.find('\n') == std::string::npos);
  CHECK_THAT(message, Contains("; "));
  return message;
}

TEST_CASE("pcd: malformed headers are refused with what is wrong") {
  struct Case {
    PcdLines lines;
    const char* says;
  };
  const Case cases[] = {{{.fields = "x y"}, "SIZE has 3 values for 2 fields"},
                        {{.fields = "x y w"}, "no field z"},
                        {{.fields = "x y x"}, "duplicate field x"},
                        {{.sizes = "4 4 3"}, "SIZE 3"},
                        {{.sizes = "4 4 16"}, "SIZE 16"},
                        {{.sizes = "4 4 2"}, "TYPE F of SIZE 2"},
                        {{.types = "F F Q"}, "TYPE Q"},
                        {{.counts = "1 1 -1"}, "COUNT of field 3"},
                        {{.counts = "1 1 2"}, "field z does not have one number"},
                        {{.counts = "1 1 99999999999999999999"}, "COUNT of field 3"},
                        {{.counts = "1 1 1000000"}, "more than 1 MiB"},
                        {{.width = "two"}, "WIDTH is not one whole number"},
                        {{.width = "3"}, "POINTS is 2, but WIDTH times HEIGHT is 3"},
                        {{.height = "18446744073709551615"}, "the limit is 16777216"},
                        {{.viewpoint = "0 0 0 1"}, "VIEWPOINT"},
                        {{.viewpoint = "0 0 0 1 0 0 nan"}, "VIEWPOINT"},
                        {{.points = "-2"}, "POINTS is not one whole number"},
                        {{.data = "gzip"}, "DATA is not ascii"}};
  for (const Case& one : cases)
    CHECK_THAT(refusal_of(pcd_header(one.lines) + kTwoPoints), Contains(one.says));
}

TEST_CASE("pcd: what is no PCD file, or ends in its header") {
  CHECK_THAT(refusal_of(""), Contains("no DATA line"));
  CHECK_THAT(refusal_of("ply\nformat ascii 1.0\n"), Contains("does not begin as a PCD file does"));
  CHECK_THAT(refusal_of(std::string("\x7f"
                                    "ELF\x02\x01",
                                    6)),
             Contains("does not begin as a PCD file does"));
  CHECK_THAT(refusal_of("VERSION 0.7\n\xff\xfe\x80 binary"), Contains("unknown keyword '\?\?\?'"));
  const std::string header = pcd_header({});
  for (std::size_t bytes = 0; bytes + 6 < header.size(); ++bytes)
    refusal_of(header.substr(0, bytes));
  CHECK_THAT(refusal_of(std::string(1U << 17U, '#')), Contains("no DATA line"));
  CHECK_THAT(refusal_of("FIELDS x y z\n" + header), Contains("line 4: duplicate FIELDS"));
}

TEST_CASE("pcd: rows that are none") {
  const std::string header = pcd_header({});
  CHECK_THAT(refusal_of(header + "1 2 3\n4 five 6\n"), Contains("line 13: a word is not a number"));
  CHECK_THAT(refusal_of(header + "1 2 3\n4 5\n6 7 8"),
             Contains("line 13: the row does not have the 3 numbers"));
  CHECK_THAT(refusal_of(header + "1 2 3 4\n4 5 6\n"),
             Contains("line 12: the row does not have the 3 numbers"));
  CHECK_THAT(refusal_of(header + kTwoPoints + "7 8 9\n"), Contains("more points than the 2"));
  CHECK_THAT(refusal_of(header + "1.0000000 2 3\n"),
             Contains("it has 1 points, but its header says 2"));
}

TEST_CASE("pcd: a label that is no whole number") {
  PcdLines lines;
  lines.fields = "x y z label";
  lines.sizes = "4 4 4 4";
  lines.types = "F F F F";
  lines.counts = "1 1 1 1";
  CHECK_THAT(refusal_of(pcd_header(lines) + "1 2 3 40\n1 2 3 40.5\n"),
             Contains("line 13: the label"));
  lines.data = "binary";
  std::string payload;
  for (const float value : {1.0F, 2.0F, 3.0F, 40.0F, 1.0F, 2.0F, 3.0F, 1e30F})
    payload += bytes_of(value);
  CHECK_THAT(refusal_of(pcd_header(lines) + payload), Contains("label of point 1"));
}

TEST_CASE("pcd: every truncation of binary points is refused") {
  PcdLines lines;
  for (const char* const data : {"binary", "binary_compressed"}) {
    lines.data = data;
    std::string payload;
    for (const float value : {1.0F, 4.0F, 2.0F, 5.0F, 3.0F, 6.0F}) payload += bytes_of(value);
    if (lines.data == "binary_compressed") payload = compressed(payload);
    const std::string header = pcd_header(lines);
    REQUIRE(read_as_pcd(header + payload).failure == "");
    for (std::size_t bytes = 0; bytes < payload.size(); ++bytes)
      refusal_of(header + payload.substr(0, bytes));
  }
}

TEST_CASE("pcd: counts that lie are refused, and nothing is allocated for them") {
  for (const char* const data : {"ascii", "binary", "binary_compressed"}) {
    PcdLines lines;
    lines.data = data;
    lines.points = lines.width = "16777216";
    const std::string file = pcd_header(lines) + std::string(64, '\x01');
    Cloud cloud;
    CHECK_FALSE(read_pcd({"a.pcd", file}, cloud).ok());
    CHECK(cloud.points_xyzi.capacity() == 0);
    lines.points = lines.width = "16777217";
    CHECK_THAT(refusal_of(pcd_header(lines)), Contains("the limit is 16777216"));
  }
  PcdLines lines;
  lines.data = "binary";
  lines.points = lines.width = "1";
  CHECK_THAT(refusal_of(pcd_header(lines) + std::string(36, '\x01')),
             Contains("it has 3 points, but its header says 1"));
}

TEST_CASE("pcd: compressed sizes that lie, and a bomb") {
  PcdLines lines;
  lines.data = "binary_compressed";
  const std::string two_points = compressed(std::string(24, 'a'));
  const std::string header = pcd_header(lines);
  // More compressed bytes than there are, as the other byte order would say.
  CHECK_THAT(refusal_of(header + bytes_of(std::uint32_t{9}, true) + two_points.substr(4)),
             Contains("other byte order"));
  CHECK_THAT(refusal_of(header + two_points.substr(0, 4) + bytes_of(std::uint32_t{1} << 31U) +
                        two_points.substr(8)),
             Contains("claim to become 2147483648"));
  lines.points = lines.width = "1000000";
  const std::string bomb =
      bytes_of(std::uint32_t{16}) + bytes_of(std::uint32_t{12000000}) + std::string(16, '\xff');
  Cloud cloud;
  const std::string file = pcd_header(lines) + bomb;
  CHECK_FALSE(read_pcd({"a.pcd", file}, cloud).ok());
  CHECK(cloud.points_xyzi.capacity() == 0);
  CHECK_THAT(refusal_of(header + bytes_of(std::uint32_t{4}) + bytes_of(std::uint32_t{24}) +
                        std::string(4, '\xff')),
             Contains("compressed points are damaged"));
  // What a file of 10 MiB may hold, and no machine should be asked for.
  PcdLines wide{
      .fields = "x y z rest", .sizes = "4 4 4 4", .types = "F F F F", .counts = "1 1 1 1000"};
  wide.data = "binary_compressed";
  wide.points = wide.width = "200000";
  CHECK_THAT(refusal_of(pcd_header(wide) + two_points),
             Contains("take 773 MiB, unpacked and as a scan, the limit is 512"));
}

TEST_CASE("pcd: nothing is quoted of a file that is none, nor of words that begin as no number") {
  const std::string secret = "root:*:20228:0:99999:7:::";
  for (const std::string& file :
       {secret + "\n", "# " + secret + "\n" + secret + "\n", pcd_header({}) + secret + " 1 2\n"}) {
    INFO(file);
    CHECK_THAT(refusal_of(file), !Contains("root") && !Contains("20228"));
  }
}

TEST_CASE("pcd: floats of the other byte order") {
  PcdLines lines;
  lines.data = "binary";
  lines.points = lines.width = "8";
  std::string swapped;
  std::string plain;
  for (int i = 0; i < 24; ++i) {
    const float value = 0.37F * static_cast<float>(i + 1);
    swapped += bytes_of(value, true);
    plain += bytes_of(value);
  }
  CHECK(read_as_pcd(pcd_header(lines) + plain).failure == "");
  CHECK_THAT(refusal_of(pcd_header(lines) + swapped), Contains("other byte order"));
  lines.sizes = "8 8 8";
  std::string wide;
  for (int i = 0; i < 24; ++i) wide += bytes_of(0.37 * (i + 1), true);
  CHECK_THAT(refusal_of(pcd_header(lines) + wide), Contains("other byte order"));
}

TEST_CASE("pcd: compressed bytes that are too few for what they become say so") {
  PcdLines lines;
  lines.data = "binary_compressed";
  lines.points = lines.width = "1000";
  CHECK_THAT(refusal_of(pcd_header(lines) + bytes_of(std::uint32_t{4}) +
                        bytes_of(std::uint32_t{12000}) + "abcd"),
             Contains("4 compressed bytes cannot become the 12000"));
}

}  // namespace
}  // namespace tessera
