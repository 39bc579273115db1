// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The lines of text that OctoMap's files begin with.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "posix/outcome.hpp"

namespace tessera {

/// The whole of a file and its name, for messages.
struct OctreeBytes {
  std::string_view path;
  std::string_view bytes;
};

struct OctreeHeader {
  bool is_binary = false;  ///< .bt: two bits a child; else .ot: a node's data, then its children.
  std::size_t node_bytes = 0;    ///< .ot: of a node's data, which a float of log-odds begins.
  std::uint64_t nodes = 0;       ///< The root and all below it.
  double resolution_m = 0.0;     ///< Above 0.
  std::size_t header_bytes = 0;  ///< The tree begins there.
};

/// "path: what; remedy", in one line of printable ASCII.
[[nodiscard]] Failure octree_failure(std::string_view path, std::string_view what,
                                     std::string_view remedy);

/// Reads the lines before the tree: the first says which of the two formats, then comments, id,
/// size, res and data. Fails with kUsage iff there is another first line, a line that is none of
/// these or comes twice, one that is missing, an id other than OcTree and ColorOcTree, a size or a
/// resolution that is no such number, or more than 4096 bytes of it.
Outcome<OctreeHeader> parse_octree_header(const OctreeBytes& file);

}  // namespace tessera
