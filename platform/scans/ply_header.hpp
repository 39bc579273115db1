// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The header of a PLY file: elements and their properties, in any number and order.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "base/outcome.hpp"
#include "scans/cloud.hpp"
#include "scans/point_fields.hpp"
#include "scans/stored_number.hpp"

namespace tessera {

struct PlyProperty {
  std::string name;
  StoredNumber number;  ///< For a list, of its entries.
  bool is_list = false;
  StoredNumber length;  ///< Type of the number of entries of a list.
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;

  /// Least bytes of an element, with empty lists.
  [[nodiscard]] std::uint64_t least_bytes(bool is_ascii) const noexcept;
};

struct PlyHeader {
  std::vector<PlyElement> elements;
  std::size_t vertex_index = 0;  ///< Index of the element that is read.
  PointFields chosen;            ///< Among the properties of the vertices.
  bool is_ascii = false;
  std::size_t header_bytes = 0;
  std::size_t header_lines = 0;

  [[nodiscard]] const PlyElement& vertices() const noexcept { return elements[vertex_index]; }
  [[nodiscard]] CloudSummary summary() const noexcept;
};

/// head: the first bytes of a file of file_bytes. Fails with kUsage, naming the file, the line and
/// the remedy, iff the header is malformed or does not end within kMostCloudHeaderBytes, there is
/// no element vertex with scalar properties x, y and z, there are more than kMostCloudPoints of it,
/// or the file is too short for what the header promises.
Outcome<PlyHeader> parse_ply_header(const CloudBytes& head, std::uint64_t file_bytes);

}  // namespace tessera
