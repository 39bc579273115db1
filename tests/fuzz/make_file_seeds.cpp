// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Files that are small and would be large in memory: text packed into images, TOML of many parts.
#include <zlib.h>

#include <string>
#include <string_view>

#include "fuzz/file_seeds.hpp"

namespace tessera::fuzz {
namespace {

std::string big_endian(std::uint32_t value) {
  std::string bytes;
  for (int shift = 24; shift >= 0; shift -= 8) bytes.push_back(static_cast<char>(value >> shift));
  return bytes;
}

std::string chunk(const std::string& kind, const std::string& content) {
  const std::string all = kind + content;
  const uLong sum =
      ::crc32(0, reinterpret_cast<const Bytef*>(all.data()), static_cast<uInt>(all.size()));
  return big_endian(static_cast<std::uint32_t>(content.size())) + all +
         big_endian(static_cast<std::uint32_t>(sum));
}

std::string packed(const std::string& content) {
  uLongf size = ::compressBound(content.size());
  std::string bytes(size, '\0');
  static_cast<void>(::compress2(reinterpret_cast<Bytef*>(bytes.data()), &size,
                                reinterpret_cast<const Bytef*>(content.data()), content.size(), 9));
  bytes.resize(size);
  return bytes;
}

/// 8 x 6 pixels of 16 bits, as the camera of the body "depth_images" has; extra: before them.
std::string image(const std::string& extra) {
  const std::string header = big_endian(8) + big_endian(6) + std::string("\20\0\0\0\0", 5);
  return "\x89PNG\r\n\x1a\n" + chunk("IHDR", header) + extra +
         chunk("IDAT", packed(std::string(6 * 17, '\0'))) + chunk("IEND", {});
}

std::vector<std::byte> input(char kind, std::string_view text) {
  std::vector<std::byte> bytes{static_cast<std::byte>(kind)};
  for (const char letter : text) bytes.push_back(static_cast<std::byte>(letter));
  return bytes;
}

std::string repeated(std::string_view text, int count) {
  std::string all;
  for (; count > 0; --count) all += text;
  return all;
}

}  // namespace

std::vector<std::vector<std::byte>> image_seeds() {
  // 600 KB in 600 bytes.
  const std::string text = packed(std::string(600'000, 'a'));
  const std::string zeros(4, '\0');
  std::vector<std::vector<std::byte>> seeds;
  for (const std::string& extra :
       {chunk("zTXt", "a" + zeros.substr(2) + text),
        chunk("iTXt", "a" + std::string("\0\1\0\0\0", 5) + text),
        chunk("iCCP", "a" + zeros.substr(2) + text),
        chunk("sPLT", "a" + std::string("\0\10", 2) + std::string(60, 'a')),
        chunk("tEXt", "a" + zeros.substr(3) + "b"), chunk("abCd", std::string(60, 'a'))})
    seeds.push_back(input(3, image(extra)));
  return seeds;
}

std::vector<std::vector<std::byte>> toml_seeds() {
  return {input(3, "[a" + repeated(".a", 900) + "]\n"),
          input(3, "a=[" + repeated("{},", 600) + "]\n"),
          input(3, "a=[" + repeated("0,", 900) + "]\n"), input(3, repeated("[[class]]\n", 180)),
          input(3, "a" + repeated(".a", 900) + "=0\n")};
}

}  // namespace tessera::fuzz
