// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Label images come back as they were written; what is no such image is refused.
#include "pictures/png_image.hpp"

#include <catch2/catch.hpp>
#include <string>

#include "support/temporary_folder.hpp"

namespace tessera {
namespace {

using Catch::Matchers::Contains;
using test::TemporaryFolder;

constexpr int kWidth = 37;
constexpr int kHeight = 11;

std::vector<std::uint8_t> sample_pixels(int bytes_per_pixel = 1) {
  std::vector<std::uint8_t> pixels(static_cast<std::size_t>(kWidth * kHeight * bytes_per_pixel));
  for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = static_cast<std::uint8_t>(i * 7);
  return pixels;
}

std::string encoded(const std::vector<std::uint8_t>& pixels, int bytes_per_pixel = 1) {
  const Outcome<std::vector<std::byte>> png =
      encode_png({kWidth, kHeight, bytes_per_pixel, pixels.data()});
  REQUIRE(png.ok());
  return {reinterpret_cast<const char*>(png->data()), png->size()};
}

Outcome<void> read(const TemporaryFolder& folder, std::vector<std::uint8_t>& out,
                   int width = kWidth, int height = kHeight) {
  out.assign(static_cast<std::size_t>(width * height), 0);
  return read_grey_png(folder.file("a.png"), width, height, out);
}

TEST_CASE("png: every value of a grey image comes back") {
  const TemporaryFolder folder;
  folder.write("a.png", encoded(sample_pixels()));
  std::vector<std::uint8_t> out;
  REQUIRE(read(folder, out).ok());
  CHECK(out == sample_pixels());
}

TEST_CASE("png: a header of another size behind what looks like one is not believed") {
  std::string png = encoded(sample_pixels());
  // A chunk of 13 bytes that nobody must know, with a size of its own, before the header.
  const std::string other("\0\0\0\15abCd\0\0\0\4\0\0\0\4\10\0\0\0\0????", 25);
  png.insert(8, other);
  const TemporaryFolder folder;
  folder.write("a.png", png);
  std::vector<std::uint8_t> out;
  CHECK_FALSE(read(folder, out, 4, 4).ok());
}

TEST_CASE("png: a gamma in the file changes no value") {
  std::string png = encoded(sample_pixels());
  // gAMA of 1.0 right after the header, with its checksum.
  const std::string gamma("\0\0\0\4gAMA\0\1\x86\xa0\x31\xe8\x96\x5f", 16);
  png.insert(33, gamma);
  const TemporaryFolder folder;
  folder.write("a.png", png);
  std::vector<std::uint8_t> out;
  const Outcome<void> done = read(folder, out);
  INFO((done.ok() ? "" : done.failure().text()));
  REQUIRE(done.ok());
  CHECK(out == sample_pixels());
}

TEST_CASE("png: the same pixels give the same bytes") {
  CHECK(encoded(sample_pixels()) == encoded(sample_pixels()));
}

TEST_CASE("png: colours and other sizes are refused with the remedy") {
  const TemporaryFolder folder;
  folder.write("a.png", encoded(sample_pixels(3), 3));
  std::vector<std::uint8_t> out;
  Outcome<void> done = read(folder, out);
  REQUIRE_FALSE(done.ok());
  CHECK_THAT(done.failure().text(), Contains("a.png") && Contains("8-bit grey"));
  folder.write("a.png", encoded(sample_pixels()));
  done = read(folder, out, kWidth + 1, kHeight);
  REQUIRE_FALSE(done.ok());
  CHECK_THAT(done.failure().text(), Contains("37 x 11") && Contains("38 x 11"));
}

TEST_CASE("png: a file cut anywhere, or with a bit turned, is refused or reads the same") {
  const std::string png = encoded(sample_pixels());
  const TemporaryFolder folder;
  std::vector<std::uint8_t> out;
  for (std::size_t bytes = 0; bytes < png.size(); ++bytes) {
    folder.write("a.png", png.substr(0, bytes));
    const Outcome<void> done = read(folder, out);
    REQUIRE_FALSE(done.ok());
    REQUIRE_THAT(done.failure().text(), Contains("a.png") && Contains("get a complete copy"));
  }
  int refused = 0;
  for (std::size_t bit = 0; bit < 8 * png.size(); bit += 3) {
    std::string damaged = png;
    damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ (1 << (bit % 8)));
    folder.write("a.png", damaged);
    const bool ok = read(folder, out).ok();
    if (ok) REQUIRE(out == sample_pixels());
    refused += ok ? 0 : 1;
  }
  CHECK(refused > static_cast<int>(8 * png.size() / 3 * 9 / 10));
}

TEST_CASE("png: a missing file is told by its name") {
  const TemporaryFolder folder;
  std::vector<std::uint8_t> out;
  const Outcome<void> done = read(folder, out);
  REQUIRE_FALSE(done.ok());
  CHECK_THAT(done.failure().text(), Contains("a.png"));
}

}  // namespace
}  // namespace tessera
