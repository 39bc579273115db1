// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What is packed into a PNG beside its pixels takes no memory.
#include <zlib.h>

#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "pictures/png_image.hpp"
#include "scans/depth_folder.hpp"
#include "support/heap_peak.hpp"
#include "support/reader_memory.hpp"
#include "support/temporary_folder.hpp"

namespace tessera {
namespace {

using test::HeapPeak;
using test::TemporaryFolder;

constexpr int kWidth = 64;
constexpr int kHeight = 48;
constexpr std::size_t kPixels = std::size_t{kWidth} * kHeight;

std::string big_endian(std::uint32_t value) {
  std::string bytes;
  for (int shift = 24; shift >= 0; shift -= 8) bytes.push_back(static_cast<char>(value >> shift));
  return bytes;
}

std::uint32_t crc_of(const std::string& bytes) {
  return static_cast<std::uint32_t>(
      ::crc32(0, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(bytes.size())));
}

std::string chunk(const std::string& kind, const std::string& content) {
  return big_endian(static_cast<std::uint32_t>(content.size())) + kind + content +
         big_endian(crc_of(kind + content));
}

std::string packed(const std::string& content) {
  uLongf size = ::compressBound(content.size());
  std::string bytes(size, '\0');
  REQUIRE(::compress2(reinterpret_cast<Bytef*>(bytes.data()), &size,
                      reinterpret_cast<const Bytef*>(content.data()), content.size(), 9) == Z_OK);
  bytes.resize(size);
  return bytes;
}

/// Grey of so many bits, all pixels 0; extra: chunks before the pixels, after: behind them.
std::string png(int bits, const std::string& extra, const std::string& after = {}) {
  std::string header = big_endian(kWidth) + big_endian(kHeight);
  header.push_back(static_cast<char>(bits));
  header.append(4, '\0');
  const std::string rows(kHeight * (1 + kWidth * static_cast<std::size_t>(bits) / 8), '\0');
  return "\x89PNG\r\n\x1a\n" + chunk("IHDR", header) + extra + chunk("IDAT", packed(rows)) + after +
         chunk("IEND", {});
}

/// Chunks of kind that unpack to 7.9 MB each.
std::string bombs(const std::string& kind, int count) {
  const std::string text = packed(std::string(7'900'000, 'a'));
  std::string all;
  for (int i = 0; i < count; ++i) {
    std::string content = std::to_string(i);
    if (kind == "zTXt" || kind == "iCCP") content.append(2, '\0').append(text);
    if (kind == "iTXt") content.append("\0\1\0\0\0", 5).append(text);
    if (kind == "sPLT") content.append("\0\10", 2).append(600, 'a');
    if (kind == "tEXt") content.append(1, '\0').append(60'000, 'a');
    if (kind == "abCd") content.append(60'000, 'a');
    all += chunk(kind, content);
  }
  return all;
}

void check_read(const std::string& file, int bits) {
  const TemporaryFolder folder;
  folder.write("a.png", file);
  const std::string path = folder.file("a.png");
  std::vector<std::uint8_t> narrow(kPixels, 1);
  std::vector<std::uint16_t> wide(kPixels, 1);
  const HeapPeak peak;
  const Outcome<void> done = bits == 8
                                 ? read_grey_png(path, kWidth, kHeight, narrow)
                                 : read_grey_png(path, kWidth, kHeight, GreyBits::kSixteen, wide);
  const std::size_t peak_bytes = peak.bytes();
  INFO((done.ok() ? "" : done.failure().text()));
  REQUIRE(done.ok());
  CHECK((bits == 8 ? narrow == std::vector<std::uint8_t>(kPixels)
                   : wide == std::vector<std::uint16_t>(kPixels)));
  CHECK(peak_bytes <= test::png_bytes(file.size(), kWidth, kHeight, bits));
}

TEST_CASE("reader memory: label and depth images take their file and pixels") {
  for (const int bits : {8, 16}) check_read(png(bits, {}), bits);
}

TEST_CASE("reader memory: packed text of a PNG takes none") {
  for (const char* kind : {"zTXt", "iTXt", "iCCP", "sPLT", "tEXt", "abCd"}) {
    for (const int bits : {8, 16}) {
      INFO(kind << ", " << bits << " bits");
      check_read(png(bits, bombs(kind, 20)), bits);
      if (std::string(kind) != "iCCP" && std::string(kind) != "sPLT")
        check_read(png(bits, {}, bombs(kind, 20)), bits);
    }
  }
}

TEST_CASE("reader memory: a folder of depth images with packed text in them and in their labels") {
  const TemporaryFolder folder;
  const std::string file = png(16, bombs("zTXt", 20));
  folder.write("depth/0.png", file);
  folder.write("labels/0.png", file);
  folder.write("camera.toml",
               "model = \"pinhole\"\nwidth = 64\nheight = 48\nfocal = [60, 60]\n"
               "centre = [31.5, 23.5]\ndepth_scale = 0.001\n");
  folder.write("poses.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n");
  DepthOptions options;
  options.label_images = folder.file("labels");
  options.intrinsics = folder.file("camera.toml");
  options.poses = folder.file("poses.txt");
  const HeapPeak peak;
  const Outcome<DepthFolder> images = DepthFolder::open(folder.file("depth"), options);
  REQUIRE(images.ok());
  Outcome<ScanReader> reader = ScanReader::make(*images);
  REQUIRE(reader.ok());
  REQUIRE(reader->read(0).ok());
  CHECK(peak.bytes() <= 2 * file.size() + (9 + 41) * kPixels + 6 * test::kSmallBytes);
}

TEST_CASE("reader memory: an image that claims to be large is refused before it takes anything") {
  std::string file = png(16, {});
  file.replace(16, 8, big_endian(0x7fffffff) + big_endian(0x7fffffff));
  const TemporaryFolder folder;
  folder.write("a.png", file);
  std::vector<std::uint16_t> out(kPixels);
  const HeapPeak peak;
  const Outcome<void> done =
      read_grey_png(folder.file("a.png"), kWidth, kHeight, GreyBits::kSixteen, out);
  const std::size_t peak_bytes = peak.bytes();
  CHECK_FALSE(done.ok());
  CHECK(peak_bytes <= file.size() + test::kSmallBytes);
}

}  // namespace
}  // namespace tessera
