// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/inference/label_field.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

namespace tessera {

Result<LabelField> LabelField::make(Arena& arena) noexcept {
  LabelField field;
  field.state_ = arena.take<State>(1);
  if (field.state_.empty()) return Status::kResourceExhausted;
  return field;
}

void LabelField::begin(const LatticeConfig& config, const ClassTable& classes,
                       double resolution_m) noexcept {
  const bool by_class = config.reach_m == 0.0F;
  const Weights one = weights_of({config.reach_m, config.height_m}, resolution_m);
  for (int label = 1; label <= classes.num_classes(); ++label)
    state_[0].weights[static_cast<std::size_t>(label)] =
        by_class ? weights_of(classes.kernel(label), resolution_m) : one;
  state_[0].known.fill({});
}

LabelField::Weights LabelField::weights_of(const ClassKernel& kernel,
                                           double resolution_m) noexcept {
  // Lengths in voxels. The window holds what is nearer than 11 voxels to any octet's middle, which
  // is 1 voxel from its own cell's.
  const auto reach = static_cast<float>(static_cast<double>(kernel.reach_m) / resolution_m);
  const auto height = static_cast<float>(static_cast<double>(kernel.height_m) / resolution_m);
  Weights weights;
  const float length = std::clamp(reach, 1.5F, 11.0F);
  for (std::size_t cell = 0; cell < kCells; ++cell) {
    const float middle =
        static_cast<float>(LabelVotes::kCellEdge) * (static_cast<float>(cell) - 1.5F);
    for (std::size_t octet = 0; octet < kOctets; ++octet) {
      const float distance = std::fabs(static_cast<float>(2 * octet + 1) - middle);
      weights.along[cell][octet] = distance < length ? 1.0F - distance / length : 0.0F;
    }
  }
  constexpr float kLayer = 2.0F;
  weights.next_layer = kLayer < height ? 1.0F - kLayer / height : 0.0F;
  return weights;
}

namespace {

/// Of the unit's labelled points, into its cell.
void vote_of_unit(const ScanTiles& tiles, const UnitSample& sample, std::size_t cell, int classes,
                  LabelVotes& votes) noexcept {
  for (const TilePoint& point : tiles.points().subspan(sample.begin, sample.end - sample.begin)) {
    for_labels(point, [&](std::uint8_t component, std::uint8_t weight) {
      if (component == 0 || component > classes) return;
      votes.add(cell, component,
                LabelVotes::votes_of(point.weight * share_of(weight) * LabelVotes::kPerPoint));
    });
  }
}

}  // namespace

std::uint32_t LabelField::vote(LocalMap& map, const ScanTiles& tiles) noexcept {
  std::uint32_t faults = 0;
  const int classes = map.classes().num_classes();
  for (const Tile& tile : tiles.tiles()) {
    const SlabHandle block = tile.blocks[0];
    if (tile.wanted == 0 || block == 0) continue;
    unsigned layers = layers_of(tile.wanted);
    const Status opened = map.open_label_layers(block, layers);
    TESSERA_ASSERT(opened == Status::kOk);
    if (opened != Status::kOk) {
      ++faults;
      continue;
    }
    for (; layers != 0; layers &= layers - 1) {
      const auto layer = static_cast<std::size_t>(std::countr_zero(layers));
      // Also where no point votes: labels that this scan fills in must not be taken for loaded
      // ones.
      LabelVotes votes = map.begun_votes(block, layer);
      const std::uint64_t occupied = tile.occupied & (std::uint64_t{0xffff} << (16 * layer));
      if (occupied == 0) continue;
      for (std::uint64_t rest = occupied; rest != 0; rest &= rest - 1) {
        const int unit = std::countr_zero(rest);
        vote_of_unit(tiles, tiles.sample(tile, unit), LabelVotes::cell_of_octet(unit), classes,
                     votes);
      }
      map.set_votes(block, layer, votes);
    }
  }
  return faults;
}

namespace {

using Votes4 = std::uint16_t __attribute__((vector_size(8)));

}  // namespace

void LabelField::look(LocalMap& map, const BlockCoord& block, unsigned layers) noexcept {
  state_[0].found = 0;
  // Of the window: bit 1 is the block's first layer.
  const unsigned needed = layers | layers << 1U | layers << 2U;
  const auto layers_beside = [](int dz) {
    return dz < 0 ? 1U : (dz > 0 ? 1U << (kLayers - 1) : unsigned{kAllLayers} << 1U);
  };
  // All are found before the first is read, so that their memory is waited for together.
  std::array<SlabHandle, 27> around{};
  SlabHandle* found = around.data();
  for (int dz = -1; dz <= 1; ++dz) {
    const bool any = (needed & layers_beside(dz)) != 0;
    for (int dy = -1; dy <= 1; ++dy, found += 3) {
      if (any) find_row(map, {block.x, block.y + dy, block.z + dz}, found);
    }
  }
  found = around.data();
  for (int dz = -1; dz <= 1; ++dz) {
    for (std::size_t y = 0; y < kCells; y += 2) {
      for (std::size_t x = 0; x < kCells; x += 2, ++found)
        if (*found != 0) gather(map, *found, needed & layers_beside(dz), x, y);
    }
  }
  for (std::uint64_t rest = state_[0].found; rest != 0; rest &= rest - 1)
    sum(static_cast<std::size_t>(std::countr_zero(rest)), layers);
}

void LabelField::find_row(const LocalMap& map, const BlockCoord& middle,
                          SlabHandle* into) noexcept {
  KnownBlock* const row = &state_[0].known[static_cast<std::size_t>(
      ((middle.y & 3) * kKnownRow) | ((middle.z & 3) * 4 * kKnownRow))];
  for (int dx = -1; dx <= 1; ++dx) {
    const BlockCoord at{middle.x + dx, middle.y, middle.z};
    KnownBlock& known = row[at.x & (kKnownRow - 1)];
    if (!(known.at == at)) known = {at, map.find_handle(at)};
    *into++ = known.handle;
    if (known.handle != 0) __builtin_prefetch(map.pool().at(known.handle));
  }
}

void LabelField::gather(LocalMap& map, SlabHandle block, unsigned layers, std::size_t x,
                        std::size_t y) noexcept {
  for (; layers != 0; layers &= layers - 1) {
    const auto z = static_cast<std::size_t>(std::countr_zero(layers));
    const std::size_t layer = (z + kBlockLayers - 1) % kBlockLayers;
    if (map.block_at(block).labels[layer] != 0) gather(map.begun_votes(block, layer), x, y, z);
  }
}

void LabelField::gather(const LabelVotes& votes, std::size_t x, std::size_t y,
                        std::size_t layer) noexcept {
  for (std::size_t slot = 0; slot < LabelVotes::kClasses; ++slot) {
    const std::array<std::uint16_t, LabelVotes::kCells>& of_class = votes.votes[slot];
    if (std::bit_cast<std::uint64_t>(of_class) == 0) continue;
    const std::size_t label = votes.labels[slot];
    Window& window = state_[0].windows[label];
    if (((state_[0].found >> label) & 1U) == 0) {
      window.rows = 0;
      state_[0].found |= std::uint64_t{1} << label;
    }
    const std::size_t row = layer * kCells + y;
    // Both rows of cells or neither have votes.
    if (((window.rows >> row) & 1U) == 0)
      std::fill_n(&window.votes[row * kCells], 2 * kCells, 0.0F);
    window.rows |= std::uint64_t{3} << row;
    float* const to = &window.votes[row * kCells + x];
    Votes4 of_cells;
    std::memcpy(&of_cells, of_class.data(), sizeof(of_cells));
    const Float4 cells = __builtin_convertvector(of_cells, Float4);
    std::memcpy(to, &cells, sizeof(cells) / 2);
    const Float4 next = __builtin_shufflevector(cells, cells, 2, 3, 2, 3);
    std::memcpy(to + kCells, &next, sizeof(next) / 2);
  }
}

/// Along x, then y, then z; in each sum from the lowest cell on. Rows without votes add nothing.
void LabelField::sum(std::size_t label, unsigned layers) noexcept {
  const Window& window = state_[0].windows[label];
  const Weights& weights = state_[0].weights[label];
  const std::array<Float4, kCells>& along = weights.along;
  std::array<std::array<Float4, kOctets>, kLayers> of_layers{};
  for (std::uint64_t rows = window.rows; rows != 0; rows &= rows - 1) {
    const auto row = static_cast<std::size_t>(std::countr_zero(rows));
    const float* const cells = &window.votes[row * kCells];
    Float4 sums{};
    for (std::size_t x = 0; x < kCells; ++x) sums += cells[x] * along[x];
    for (std::size_t octet = 0; octet < kOctets; ++octet)
      of_layers[row / kCells][octet] += sums * along[row % kCells][octet];
  }
  Sums& into = state_[0].sums[label];
  for (unsigned rest = layers; rest != 0; rest &= rest - 1) {
    const auto z = static_cast<std::size_t>(std::countr_zero(rest));
    for (std::size_t y = 0; y < kOctets; ++y) {
      const Float4 beside = of_layers[z][y] + of_layers[z + 2][y];
      store4(&into[(z * kOctets + y) * kOctets], of_layers[z + 1][y] + beside * weights.next_layer);
    }
  }
}

LabelShares LabelField::shares(int octet) const noexcept {
  LabelShares found;
  for (std::uint64_t rest = state_[0].found; rest != 0; rest &= rest - 1) {
    const auto label = static_cast<std::size_t>(std::countr_zero(rest));
    found.offer(static_cast<std::uint8_t>(label),
                state_[0].sums[label][static_cast<std::size_t>(octet)]);
  }
  if (found.count != 0) found.divide(kLeastShare);
  return found;
}

}  // namespace tessera
