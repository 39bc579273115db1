// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The header of a PLY file: elements and their properties, in any number and order.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "clouds/cloud.hpp"
#include "clouds/point_fields.hpp"
#include "clouds/stored_number.hpp"
#include "posix/outcome.hpp"

namespace tessera {

struct PlyProperty {
  std::string name;
  StoredNumber number;  ///< Of a list, its entries.
  bool is_list = false;
  StoredNumber length;  ///< How a list says how many entries it has.
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;

  /// What one takes at least, with its lists empty.
  [[nodiscard]] std::uint64_t least_bytes(bool is_ascii) const noexcept;
};

struct PlyHeader {
  std::vector<PlyElement> elements;
  std::size_t vertex_index = 0;  ///< Of the elements, the one that is read.
  PointFields chosen;            ///< Of the vertices' properties.
  bool is_ascii = false;
  std::size_t header_bytes = 0;
  std::size_t header_lines = 0;

  [[nodiscard]] const PlyElement& vertices() const noexcept { return elements[vertex_index]; }
  [[nodiscard]] CloudSummary summary() const noexcept;
};

/// head: the first bytes of a file of file_bytes. Fails with kUsage, naming the file, the line and
/// the remedy, iff the header is malformed or ends not within kMostCloudHeaderBytes, there is no
/// element vertex with scalar properties x, y and z, there are more than kMostCloudPoints of it, or
/// the file is too short for what the header promises.
Outcome<PlyHeader> parse_ply_header(const CloudBytes& head, std::uint64_t file_bytes);

}  // namespace tessera
