// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Writing in the kernel mode: the sums of a strip of tiles, then the map's blocks under it.
#include "tessera/inference/integrator.hpp"

namespace tessera {

namespace {

/// Calls visit(points) for runs of the points of these occupied units, in order: units one after
/// the other, with none of the tile's occupied ones between, are one run.
template <class Visit>
void for_point_runs(const ScanTiles& tiles, const Tile& tile, std::uint64_t units,
                    Visit&& visit) noexcept {
  while (units != 0) {
    const std::uint64_t lowest = units & (~units + 1);
    // Up to the first occupied unit that is left out.
    const std::uint64_t left_out = tile.occupied & ~units & ~(lowest - 1);
    const std::uint64_t run = units & ((left_out & (~left_out + 1)) - 1);
    const UnitSample& first = tiles.sample(tile, std::countr_zero(run));
    const UnitSample& last = tiles.sample(tile, 63 - std::countl_zero(run));
    visit(tiles.points().subspan(first.begin, last.end - first.begin));
    units &= ~run;
  }
}

/// The next tile along x that is still to be written, or null: what is written wants no more. Tiles
/// are linked where one's points reach the other; others that touch are found by way of a
/// neighbour that they share.
const Tile* next_to_write(const ScanTiles& tiles, const Tile& tile, int step) noexcept {
  const Tile* next = tiles.stepped(&tile, 0, step);
  for (std::size_t face = 2; face < 6 && next == nullptr; ++face) {
    const Tile* const aside = tiles.beside(tile, face);
    const Tile* const beyond = tiles.stepped(aside, 0, step);
    if (beyond != nullptr) next = tiles.beside(*beyond, face ^ 1U);
  }
  return next != nullptr && next->wanted != 0 ? next : nullptr;
}

}  // namespace

/// From each tile that is still to be written, all of its run along x.
void Integrator::write_strips(LocalMap& map, EvidenceWork& work, ScanReport& report) noexcept {
  for (const Tile& tile : tiles_.tiles()) {
    if (tile.wanted == 0) continue;
    const Tile* from = &tile;
    while (const Tile* const before = next_to_write(tiles_, *from, -1)) from = before;
    while (from != nullptr) {
      std::array<const Tile*, KernelStrip::kTiles> strip{};
      std::size_t count = 0;
      for (; count < strip.size() && from != nullptr; from = next_to_write(tiles_, *from, 1))
        strip[count++] = from;
      write_strip(map, std::span(strip).first(count), work, report);
      for (std::size_t i = 0; i < count; ++i) tiles_.mark_written(*strip[i]);
    }
  }
}

/// Points reach boxes of units, so between a tile and one that its points reach there is a tile
/// wherever the way goes: where a step leads to none, no point reaches from there.
void Integrator::add_to_strip(std::span<const Tile* const> strip, const std::array<int, 3>& offset,
                              const KernelShape& kernel, EvidenceWork& work) noexcept {
  const auto [dx, dy, dz] = offset;
  const int last = static_cast<int>(strip.size()) - 1;
  const int nearest = dx < 0 ? 0 : (dx > last ? last : dx);
  const Tile* from = tiles_.stepped(strip[static_cast<std::size_t>(nearest)], 2, dz);
  if (from != nullptr) from = tiles_.stepped(from, 1, dy);
  if (from != nullptr) from = tiles_.stepped(from, 0, dx - nearest);
  if (from == nullptr || from->occupied == 0) return;
  // Units of that tile, counted from its first, that reach the strip.
  const int reach = kernel_reach_units_;
  const std::uint64_t units =
      from->occupied &
      box_mask({-reach - 4 * dx, -reach - 4 * dy, -reach - 4 * dz},
               {4 * last + 3 + reach - 4 * dx, 3 + reach - 4 * dy, 3 + reach - 4 * dz});
  for_point_runs(tiles_, *from, units, [&](std::span<const TilePoint> points) {
    strip_.add_points(points, offset, kernel_radius_, kernel, work);
  });
}

/// In this order a voxel's sum is the same whatever strip it is in.
void Integrator::sum_strip(const LocalMap& map, std::span<const Tile* const> strip,
                           EvidenceWork& work) noexcept {
  const double resolution_m = map.lattice().resolution_m();
  const KernelShape kernel =
      shape(static_cast<float>(static_cast<double>(config_.kernel_length_m) / resolution_m));
  const int reach_tiles = (kernel_reach_units_ + 3) / 4;
  const int beyond = static_cast<int>(strip.size()) + reach_tiles;
  strip_.begin(static_cast<int>(strip.size()));
  // Sums take longer than memory does.
  for (const Tile* const tile : strip) {
    if (tile->blocks[0] != 0) map.prefetch_pages(tile->blocks[0]);
  }
  for (int dz = -reach_tiles; dz <= reach_tiles; ++dz) {
    for (const Tile* const tile : strip) {
      if (dz == 0 && tile->blocks[0] != 0) map.prefetch_octets(tile->blocks[0], tile->wanted);
    }
    for (int dy = -reach_tiles; dy <= reach_tiles; ++dy) {
      if (reach_tiles > 1) {
        for (int dx = -reach_tiles; dx < beyond; ++dx)
          add_to_strip(strip, {dx, dy, dz}, kernel, work);
        continue;
      }
      // Bit i + 1: some tile of the strip has the one at i for a source.
      unsigned sources = 0;
      for (std::size_t i = 0; i < strip.size(); ++i)
        sources |= ((strip[i]->sources >> static_cast<unsigned>(12 + 3 * dy + 9 * dz)) & 7U) << i;
      for (; sources != 0; sources &= sources - 1)
        add_to_strip(strip, {std::countr_zero(sources) - 1, dy, dz}, kernel, work);
    }
  }
}

void Integrator::write_strip(LocalMap& map, std::span<const Tile* const> strip, EvidenceWork& work,
                             ScanReport& report) noexcept {
  sum_strip(map, strip, work);
  for (std::size_t i = 0; i < strip.size(); ++i) {
    const SlabHandle block = strip[i]->blocks[0];
    const int tile = static_cast<int>(i);
    const std::uint64_t octets = strip[i]->wanted & strip_.touched(tile);
    if (octets == 0 || block == 0) continue;
    // Room was reserved before anything was written, so this cannot fail.
    const Result<int> written = map.add_labels(block, octets, strip_.sums(tile));
    TESSERA_ASSERT(written.ok());
    report.label_octets += static_cast<std::uint32_t>(*written);
  }
}

}  // namespace tessera
