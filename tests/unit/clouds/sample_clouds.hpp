// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Files of clouds, put together byte by byte, so that what is read is not compared with itself.
#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "scans/cloud.hpp"

namespace tessera::test {

/// The bytes of a number, little-endian unless said otherwise.
template <class T>
std::string bytes_of(T value, bool big_endian = false) {
  static_assert(std::is_arithmetic_v<T> && std::endian::native == std::endian::little);
  std::string bytes(reinterpret_cast<const char*>(&value), sizeof value);
  if (big_endian) std::reverse(bytes.begin(), bytes.end());
  return bytes;
}

/// The lines from FIELDS to DATA; views of literals. fields, sizes, types, counts: as in the file.
struct PcdLines {
  std::string_view fields = "x y z";
  std::string_view sizes = "4 4 4";
  std::string_view types = "F F F";
  std::string_view counts = "1 1 1";
  std::string_view width = "2";
  std::string_view height = "1";
  std::string_view viewpoint = "0 0 0 1 0 0 0";
  std::string_view points = "2";
  std::string_view data = "ascii";
};
std::string pcd_header(const PcdLines& lines);

/// With the two sizes before it, by liblzf.
std::string compressed(const std::string& payload);

struct Read {
  std::string failure;  ///< Empty: it was read.
  Cloud cloud;
};
Read read_as_pcd(const std::string& file);
Read read_as_ply(const std::string& file);

/// Of each point the first three, in a row.
std::vector<float> coordinates(const Cloud& cloud);

}  // namespace tessera::test
