// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Block contents for fuzzing: with memory of their own, and drawn from an input.
#pragma once

#include <stdexcept>

#include "fuzz/fuzz.hpp"
#include "support/mapper.hpp"
#include "tessera/map/block_content.hpp"

namespace tessera::fuzz {

class OwnContent {
 public:
  explicit OwnContent(int num_components = kMaxComponents)
      : memory_(BlockContent::required_bytes(num_components)) {
    Arena arena(memory_.span());
    Result<BlockContent> made = BlockContent::make(arena, num_components);
    if (!made.ok()) throw std::logic_error("no room for a block's content");
    content_ = *made;
  }
  /// As it was made.
  [[nodiscard]] BlockContent& cleared() {
    content_.clear();
    return content_;
  }

 private:
  AlignedMemory memory_;
  BlockContent content_;
};

/// Adds what the input says to voxels of its choice: any counts, any passes.
void draw_content(Input& input, int num_components, BlockContent& content);

}  // namespace tessera::fuzz
