// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The blocks of a map file, in the order in which a robot that drives along x comes by them: what a
// robot of a test publishes instead of random blocks.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "support/mapper.hpp"
#include "tessera/map/map_file.hpp"

namespace tessera::network {

class MapBlocks {
 public:
  /// Throws std::runtime_error iff path is no map file of a local map.
  explicit MapBlocks(const std::string& path);
  [[nodiscard]] std::size_t size() const { return blocks_.size(); }
  [[nodiscard]] const LocalMap& map() const { return map_; }
  /// Fills in the content of the i-th, rounded as the wire says it.
  BlockKey read(std::size_t i, BlockContent& content) const;

 private:
  std::unique_ptr<AlignedMemory> memory_;
  LocalMap map_;
  std::vector<KeyedIndex> blocks_;
};

}  // namespace tessera::network
