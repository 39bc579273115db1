// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/map/local_map.hpp"

#include <bit>

#include "tessera/base/internal/bits.hpp"
#include "tessera/map/internal/block_editor.hpp"
#include "tessera/map/internal/query_group.hpp"

namespace tessera {

namespace {

// On their own: what they take of the stack, maps of 3 kB, is not below all that makes one.
[[gnu::noinline]] Result<LocalMap> without_memory() noexcept { return LocalMap(); }
[[gnu::noinline]] void refuse(Result<LocalMap>& made, Status status) noexcept { made = status; }
[[gnu::noinline]] void forget(LocalMap& place) noexcept { place = LocalMap(); }

}  // namespace

Result<LocalMap> LocalMap::make(Arena& arena, const MapConfig& config,
                                const ClassTable& classes) noexcept {
  Result<LocalMap> made = without_memory();
  const Status status = make_at(*made, arena, config, classes);
  if (status != Status::kOk) refuse(made, status);
  return made;
}

Status LocalMap::make_at(LocalMap& place, Arena& arena, const MapConfig& config,
                         const ClassTable& classes) noexcept {
  const Status status = place.set_up(arena, config, classes);
  if (status == Status::kOk)
    place.fill_states_of_passes();
  else
    forget(place);
  return status;
}

void LocalMap::fill_states_of_passes() noexcept {
  unobserved_ = CountSummary(num_components(), 0.0F).estimate(config().prior);
  float passes = 0.0F;
  only_labels_occupy_ = true;
  for (VoxelState& state : states_of_passes_) {
    state = CountSummary(num_components(), passes * config().free_weight)
                .estimate(config().prior)
                .state;
    only_labels_occupy_ = only_labels_occupy_ && state != VoxelState::kOccupied;
    passes += 1.0F;
  }
}

// --- Reading -------------------------------------------------------------------------------------

VoxelEvidence LocalMap::evidence(VoxelCoord voxel) const noexcept {
  const Block* const block = in_grid(voxel) ? find(block_of(voxel)) : nullptr;
  if (block == nullptr) {
    VoxelEvidence nothing;
    nothing.num_components = num_components();
    return nothing;
  }
  return evidence(*block, octet_in_block(voxel), voxel_in_octet(voxel));
}

VoxelEvidence LocalMap::evidence(const Point3f& p_map) const noexcept {
  const Result<VoxelCoord> voxel = lattice().voxel_of(p_map);
  if (voxel.ok()) return evidence(*voxel);
  VoxelEvidence nothing;
  nothing.num_components = num_components();
  return nothing;
}

Estimate LocalMap::query(const Point3f& p_map) const noexcept {
  const Result<VoxelCoord> voxel = lattice().voxel_of(p_map);
  return voxel.ok() ? query(*voxel) : unobserved_;
}

Estimate LocalMap::query(VoxelCoord voxel) const noexcept {
  if (!in_grid(voxel)) return unobserved_;
  const SlabHandle handle = find_handle(pack_in_grid(block_of(voxel)));
  return handle == 0 ? unobserved_ : query(block_at(handle), voxel);
}

Estimate LocalMap::query(const Block& block, VoxelCoord voxel) const noexcept {
  CountSummary counts(num_components(), static_cast<float>(free_passes(block, row_order(voxel))) *
                                            config().free_weight);
  const SlabHandle tuples = octet_handle(block, octet_in_block(voxel));
  if (tuples != 0) this->tuples().summarize(pool().at(tuples), voxel_in_octet(voxel), counts);
  return counts.estimate(reading());
}

Status LocalMap::query(std::span<const VoxelCoord> voxels,
                       std::span<Estimate> into) const noexcept {
  if (voxels.size() != into.size()) return Status::kInvalidArgument;
  QueryGroup::query(*this, voxels, into, [](const VoxelCoord& voxel) { return voxel; });
  return Status::kOk;
}

Status LocalMap::query(std::span<const Point3f> points_map,
                       std::span<Estimate> into) const noexcept {
  if (points_map.size() != into.size()) return Status::kInvalidArgument;
  constexpr VoxelCoord kNowhere{kVoxelLimit, 0, 0};  // no voxel of the grid
  const Lattice grid = lattice();
  QueryGroup::query(*this, points_map, into, [&](const Point3f& p_map) {
    const Result<VoxelCoord> voxel = grid.voxel_of(p_map);
    return voxel.ok() ? *voxel : kNowhere;
  });
  return Status::kOk;
}

// --- Writing -------------------------------------------------------------------------------------

Status LocalMap::add_labels(SlabHandle handle, int octet, const OctetEvidence& added) noexcept {
  return OctetWriter(*this, handle).add(octet, added);
}

/// In rounds, so that the octets' memory, which mostly is in no cache, is waited for together.
Result<int> LocalMap::add_labels(SlabHandle handle, std::uint64_t octets,
                                 const BlockEvidence& added) noexcept {
  std::array<std::uint64_t, kBlockOctets> components{};
  std::uint64_t wanted = 0;
  for (; octets != 0; octets &= octets - 1) {
    const int octet = std::countr_zero(octets);
    std::uint64_t& present = components[static_cast<std::size_t>(octet)];
    present = added.components_of(octet);
    if ((present & ~std::uint64_t{1}) != 0) wanted |= octets & (~octets + 1);
  }
  if (wanted == 0) return 0;
  BlockEditor editor(*this, handle);
  Status status = Status::kOk;
  std::uint64_t ready = 0;
  for (std::uint64_t rest = wanted; rest != 0; rest &= rest - 1) {
    const int octet = std::countr_zero(rest);
    status = editor.ensure_octet(octet);
    if (status != Status::kOk) break;
    tuples().prefetch_to_add(editor.tuples(octet));
    ready |= rest & (~rest + 1);
  }
  for (std::uint64_t rest = ready; rest != 0; rest &= rest - 1)
    tuples().prefetch_planes(editor.tuples(std::countr_zero(rest)));
  for (std::uint64_t rest = ready; rest != 0; rest &= rest - 1) {
    const int octet = std::countr_zero(rest);
    editor.add_labels(octet,
                      OctetOfBlock(added, octet, components[static_cast<std::size_t>(octet)]));
  }
  if (ready != 0) editor.note_revision();
  if (status != Status::kOk) return status;
  return count_ones(ready);
}

Status LocalMap::add_free_pass(SlabHandle handle, const VoxelMask& mask) noexcept {
  const Block& block = block_at(handle);
  const std::uint32_t new_pages = free_pages_needed(block, mask);
  if (new_pages > 0 && !fits_or_refuse({0, 0, new_pages, 0})) return Status::kResourceExhausted;
  BlockEditor editor(*this, handle);
  bool changed = false;
  for (std::size_t layer = 0; layer < kBlockLayers; ++layer) {
    const BlockEditor::Slices slices{mask[2 * layer], mask[2 * layer + 1]};
    if ((slices[0] | slices[1]) == 0) continue;
    editor.ensure_free_page(layer);
    changed = editor.count_passes(layer, slices) || changed;
    if (config().max_evidence > 0.0F && block.labels[layer] != 0)
      changed = editor.give_way(layer, slices) || changed;
  }
  if (changed) editor.note_revision();
  return Status::kOk;
}

namespace {

bool has_labels(const VoxelEvidence& evidence) noexcept {
  if (evidence.rest > 0.0F) return true;
  for (std::size_t l = 1; l < static_cast<std::size_t>(evidence.num_components); ++l) {
    if (evidence.sigma[l] > 0.0F) return true;
  }
  return false;
}

/// What a voxel of an octet needs that is not there yet.
SlabPool::Counts room_for(const BlockTable& table, const Block& block, int octet, bool labels,
                          bool passes) noexcept {
  const std::size_t layer = layer_of_octet(octet);
  const bool new_octet = labels && table.octet_handle(block, octet) == 0;
  const bool new_label_page = new_octet && block.labels[layer] == 0;
  const bool new_free_page = passes && block.free_passes[layer] == 0;
  return {0, new_label_page ? 1U : 0U, new_free_page ? 1U : 0U, new_octet ? 1U : 0U};
}

}  // namespace

Status LocalMap::restore(SlabHandle handle, int octet, int voxel, const VoxelEvidence& evidence,
                         std::uint8_t passes) noexcept {
  if (passes > max_passes() || !tuples().holds(evidence)) return Status::kInvalidArgument;
  const bool labelled = has_labels(evidence);
  if (!fits_or_refuse(room_for(*this, block_at(handle), octet, labelled, passes > 0)))
    return Status::kResourceExhausted;
  BlockEditor editor(*this, handle);
  if (passes > 0) {
    editor.ensure_free_page(layer_of_octet(octet));
    editor.set_passes(octet, voxel, passes);
  }
  if (labelled) {
    editor.set_labels(octet, voxel, evidence, false);
    vote_as(editor, handle, octet, evidence);
  }
  return Status::kOk;
}

Status LocalMap::merge(SlabHandle handle, int octet, int voxel, const VoxelEvidence& added,
                       std::uint8_t passes) noexcept {
  const Block& block = block_at(handle);
  const std::uint8_t passes_here = free_passes(block, octet, voxel);
  const bool labels_here =
      ((unsigned{observed_labels(block, octet)} >> static_cast<unsigned>(voxel)) & 1U) != 0;
  if (passes_here == 0 && !labels_here) return restore(handle, octet, voxel, added, passes);
  if (passes > max_passes() || !tuples().holds(added)) return Status::kInvalidArgument;
  const VoxelEvidence here = evidence(block, octet, voxel);
  VoxelEvidence sum = here;
  for (std::size_t l = 1; l < static_cast<std::size_t>(num_components()); ++l)
    sum.sigma[l] += added.sigma[l];
  sum.rest += added.rest;
  sum.centroid = here.centroid.nearer(added.centroid);
  const bool labelled = labels_here || has_labels(added);
  if (!fits_or_refuse(room_for(*this, block, octet, labelled, passes > 0)))
    return Status::kResourceExhausted;
  BlockEditor editor(*this, handle);
  if (passes > 0) {
    editor.ensure_free_page(layer_of_octet(octet));
    editor.set_passes(octet, voxel, unsigned{passes_here} + passes);
  }
  if (!labelled) return Status::kOk;
  tuples().condense(sum);
  editor.set_labels(octet, voxel, sum, true);
  vote_as(editor, handle, octet, added);
  return Status::kOk;
}

Status LocalMap::merge_passes(SlabHandle handle, int octet, std::span<const std::byte> passes,
                              unsigned mask) noexcept {
  unsigned given = 0;
  for (unsigned rest = mask; rest != 0; rest &= rest - 1) {
    const auto voxel = static_cast<unsigned>(std::countr_zero(rest));
    const auto more = std::to_integer<std::uint8_t>(passes[voxel]);
    if (more > max_passes()) return Status::kInvalidArgument;
    given |= (more != 0 ? 1U : 0U) << voxel;
  }
  if (given == 0) return Status::kOk;
  const Block& block = block_at(handle);
  TESSERA_ASSERT((observed_labels(block, octet) & given) == 0);
  if (!fits_or_refuse(room_for(*this, block, octet, false, true)))
    return Status::kResourceExhausted;
  BlockEditor editor(*this, handle);
  editor.ensure_free_page(layer_of_octet(octet));
  editor.add_passes(octet, passes, given);
  return Status::kOk;
}

Status LocalMap::replace(SlabHandle handle, const BlockContent& content) noexcept {
  BlockEditor editor(*this, handle);
  editor.clear();
  editor.note_revision();
  const std::uint64_t label_octets = content.label_octets();
  const std::uint64_t pass_octets = content.pass_octets();
  SlabPool::Counts wanted{};
  for (unsigned layer = 0; layer < kBlockLayers; ++layer) {
    constexpr std::uint64_t kOfLayer = (std::uint64_t{1} << unsigned{kLayerOctets}) - 1;
    const std::uint64_t labels = (label_octets >> (layer * kLayerOctets)) & kOfLayer;
    wanted[kLabelSlab] += labels != 0 ? 1U : 0U;
    wanted[kOctetSlab] += static_cast<std::uint32_t>(count_ones(labels));
    wanted[kFreeSlab] += ((pass_octets >> (layer * kLayerOctets)) & kOfLayer) != 0 ? 1U : 0U;
  }
  if (!fits_or_refuse(wanted)) return Status::kResourceExhausted;
  for (std::uint64_t rest = pass_octets; rest != 0; rest &= rest - 1) {
    const int octet = std::countr_zero(rest);
    editor.ensure_free_page(layer_of_octet(octet));
    for (int v = 0; v < kOctetVoxels; ++v)
      editor.set_passes(octet, v, content.passes(row_order(octet, v)));
  }
  for (std::uint64_t rest = label_octets; rest != 0; rest &= rest - 1)
    editor.fill_octet(std::countr_zero(rest), content);
  return Status::kOk;
}

void LocalMap::restore_revision(SlabHandle block, std::uint32_t revision) noexcept {
  BlockEditor(*this, block).restore_revision(revision);
}

}  // namespace tessera
