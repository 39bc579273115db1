// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The lines of text at the beginning of OctoMap files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "base/outcome.hpp"

namespace tessera {

/// The whole content of a file, and its name for messages.
struct OctreeBytes {
  std::string_view path;
  std::string_view bytes;
};

struct OctreeHeader {
  bool is_binary =
      false;  ///< .bt: two bits per child; else .ot: the data of a node, then its children.
  std::size_t node_bytes =
      0;                    ///< .ot: bytes of a node's data, which begins with a float of log-odds.
  std::uint64_t nodes = 0;  ///< Including the root.
  double resolution_m = 0.0;     ///< Above 0.
  std::size_t header_bytes = 0;  ///< Place where the tree begins.
};

/// "path: what; remedy", in one line of printable ASCII.
[[nodiscard]] Failure octree_failure(std::string_view path, std::string_view what,
                                     const Message& remedy);

/// Reads the lines before the tree: the first has the format, then follow comments, id, size, res
/// and data. Fails with kUsage iff the first line is another one, a line is unknown, duplicate or
/// missing, the id is not OcTree or ColorOcTree, size or resolution are not valid numbers, or the
/// lines have more than 4096 bytes.
Outcome<OctreeHeader> parse_octree_header(const OctreeBytes& file);

}  // namespace tessera
