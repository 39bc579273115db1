// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The blocks of a map that is made as the command makes it, one content after the other.
#pragma once

#include <functional>

#include "scenes.hpp"
#include "tessera/map/internal/packed_block.hpp"

namespace tessera::bench {

inline constexpr Mode kCommandMode{.name = "command",
                                   .title = "lattice, free space, 40 m",
                                   .inference = InferenceMode::kLattice,
                                   .free_space = true,
                                   .storage_bytes = std::size_t{512} << 20U,
                                   .max_range_m = 40.0F};

/// The options' scans, mapped so. Fails as load_scene() and Mapper do.
inline Outcome<Mapper> map_as_command(const Options& options) {
  TESSERA_TRY_ASSIGN(const Scene scene, load_scene(options));
  Outcome<Mapper> mapper = Mapper::make(kCommandMode, scene, options.resolution_m);
  if (!mapper.ok()) return mapper.failure();
  TESSERA_TRY(mapper->integrate_all(scene));
  return mapper;
}

/// A block's content in memory of its own.
class OwnContent {
 public:
  explicit OwnContent(int num_components)
      : memory_(BlockContent::required_bytes(num_components) + kArenaAlignment) {
    Arena arena{std::span<std::byte>(memory_)};
    content_ = *BlockContent::make(arena, num_components);
  }
  [[nodiscard]] BlockContent& operator*() { return content_; }
  [[nodiscard]] BlockContent* operator->() { return &content_; }

 private:
  std::vector<std::byte> memory_;
  BlockContent content_;
};

/// Calls visit(content) for every block of the mapper, in (z, y, x) order.
template <class Visit>
void for_each_content(Mapper& mapper, Visit&& visit) {
  OwnContent own(mapper.map().num_components());
  for (const KeyedIndex& entry : mapper.map().blocks_in_order(mapper.workspace())) {
    own->clear();
    add_block(mapper.map(), mapper.map().block_at(entry.index), *own);
    visit(*own);
  }
}

}  // namespace tessera::bench
