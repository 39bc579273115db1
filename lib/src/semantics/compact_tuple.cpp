// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/semantics/internal/compact_tuple.hpp"

#include <bit>
#include <cstring>
#include <span>
#include <utility>

#include "octet_loops.hpp"
#include "tessera/base/assert.hpp"
#include "tessera/base/internal/shared_words.hpp"

namespace tessera {

CompactTuple::CompactTuple(float quanta, LaneWidth lanes) noexcept
    : quanta_(quanta), quantum_(1.0F / quanta), loops_(&octet_loops(lanes)) {}

void CompactTuple::add_to_rest(Octet& octet, std::size_t voxel, std::uint32_t count) noexcept {
  std::uint32_t& rest = octet.words[kRest][voxel];
  const std::uint32_t room = kMostCount - (rest & kMostCount);
  rest += count < room ? count : room;
}

void CompactTuple::find_slot(Octet& octet, std::size_t voxel, std::uint32_t component,
                             std::uint32_t count) noexcept {
  std::size_t smallest = 0;
  for (std::size_t s = 0; s < kSlots; ++s) {
    const std::uint32_t word = octet.words[s][voxel];
    if (word == 0) {
      octet.words[s][voxel] = component << kCountBits | count;
      return;
    }
    const std::uint32_t least = octet.words[smallest][voxel];
    const std::uint32_t a = word & kMostCount;
    const std::uint32_t b = least & kMostCount;
    // Among equals the word of the higher class is the larger one.
    if (a < b || (a == b && word > least)) smallest = s;
  }
  std::uint32_t& least = octet.words[smallest][voxel];
  if (count > (least & kMostCount)) {
    add_to_rest(octet, voxel, least & kMostCount);
    least = component << kCountBits | count;
  } else {
    add_to_rest(octet, voxel, count);
  }
}

void CompactTuple::add_plane(Octet& octet, std::uint32_t component, const Plane& plane,
                             Words& added) const noexcept {
  Words count{};
  loops_->add_to_slots(octet.words[0].data(), component, plane.data(), quanta_, count.data(),
                       added.data());
  for (std::size_t v = 0; v < kOctetVoxels; ++v) {
    if (count[v] != 0) find_slot(octet, v, component, count[v]);
  }
}

// Few of them are known: each is a byte that is not zero.
void CompactTuple::join_centroids(Octet& octet, const OctetCentroids& seen,
                                  const Words& added) noexcept {
  for (auto left = std::bit_cast<std::uint64_t>(seen); left != 0;) {
    const unsigned first_bit = static_cast<unsigned>(std::countr_zero(left)) & 56U;
    left &= ~(std::uint64_t{0xff} << first_bit);
    const std::size_t v = first_bit / 8;
    if (added[v] == 0) continue;
    std::uint32_t& rest = octet.words[kRest][v];
    const Centroid here = Centroid::of_code(static_cast<std::uint8_t>(rest >> kCountBits));
    rest = std::uint32_t{here.nearer(seen[v]).code()} << kCountBits | (rest & kMostCount);
  }
}

template <class Evidence>
CompactTuple::Plane CompactTuple::add_planes(std::byte* octet_bytes,
                                             const Evidence& added) const noexcept {
  Octet octet{};
  std::memcpy(&octet, octet_bytes, sizeof(octet));
  Words given{};
  if (added.has_rest())
    loops_->add_to_rests(octet.words[0].data(), added.read(0).data(), quanta_, given.data());
  for (std::uint64_t rest = added.components() & ~std::uint64_t{1}; rest != 0; rest &= rest - 1) {
    const int component = std::countr_zero(rest);
    add_plane(octet, static_cast<std::uint32_t>(component), added.read(component), given);
  }
  join_centroids(octet, added.centroids(), given);
  store_shared_words(octet_bytes, &octet, sizeof(octet));
  return sums_of(octet);
}
template CompactTuple::Plane CompactTuple::add_planes(std::byte*,
                                                      const OctetEvidence&) const noexcept;
template CompactTuple::Plane CompactTuple::add_planes(std::byte*,
                                                      const OctetOfBlock&) const noexcept;

CompactTuple::Plane CompactTuple::sums_of(const Octet& octet) const noexcept {
  Plane sums{};
  loops_->sum_up(octet.words[0].data(), quantum_, sums.data());
  return sums;
}

void CompactTuple::add_rest(std::byte* octet_bytes, const Plane& counts,
                            const OctetCentroids& centroids) const noexcept {
  constexpr auto kMost = static_cast<float>(kMostCount);
  Octet octet{};
  std::memcpy(&octet, octet_bytes, sizeof(octet));
  Words given{};
  for (std::size_t v = 0; v < kOctetVoxels; ++v) {
    const float exact = counts[v] * quanta_ + 0.5F;
    given[v] = static_cast<std::uint32_t>(exact < kMost ? exact : kMost);
    add_to_rest(octet, v, given[v]);
  }
  join_centroids(octet, centroids, given);
  store_shared_words(octet_bytes, &octet, sizeof(octet));
}

CompactTuple::Plane CompactTuple::label_sums(const std::byte* octet_bytes) const noexcept {
  Octet octet{};
  std::memcpy(&octet, octet_bytes, sizeof(octet));
  return sums_of(octet);
}

void CompactTuple::scale(std::byte* octet_bytes, int voxel, float factor) noexcept {
  Octet octet{};
  std::memcpy(&octet, octet_bytes, sizeof(octet));
  std::uint32_t left = 0;
  for (Words& words : octet.words) {
    std::uint32_t& word = words[static_cast<std::size_t>(voxel)];
    const auto count = static_cast<std::uint32_t>(static_cast<float>(word & kMostCount) * factor);
    left |= count;
    const bool is_centroid = &words == &octet.words[kRest] && left != 0;
    word = count == 0 && !is_centroid ? 0 : (word & ~kMostCount) | count;
  }
  store_shared_words(octet_bytes, &octet, sizeof(octet));
}

void CompactTuple::read(const std::byte* octet_bytes, int voxel,
                        VoxelEvidence& into) const noexcept {
  Octet octet{};
  std::memcpy(&octet, octet_bytes, sizeof(octet));
  const auto v = static_cast<std::size_t>(voxel);
  for (std::size_t s = 0; s < kSlots; ++s) {
    const std::uint32_t word = octet.words[s][v];
    if (word == 0) continue;
    into.sigma[word >> kCountBits] = static_cast<float>(word & kMostCount) * quantum_;
  }
  const std::uint32_t rest = octet.words[kRest][v];
  into.rest = static_cast<float>(rest & kMostCount) * quantum_;
  into.centroid = Centroid::of_code(static_cast<std::uint8_t>(rest >> kCountBits));
}

std::array<std::uint32_t, CompactTuple::kSlots + 1> CompactTuple::words_of(
    const VoxelEvidence& evidence) const noexcept {
  std::array<std::uint32_t, kSlots + 1> words{};
  const auto whole_quanta = [this](float count) {
    const float quanta = count * quanta_;
    if (!(quanta >= 0.0F && quanta <= static_cast<float>(kMostCount))) return kNotHeld;
    const auto whole = static_cast<std::uint32_t>(quanta);
    return static_cast<float>(whole) < quanta ? kNotHeld : whole;
  };
  std::size_t taken = 0;
  for (int l = 1; l < evidence.num_components; ++l) {
    const std::uint32_t count = whole_quanta(evidence.sigma[static_cast<std::size_t>(l)]);
    if (count == 0) continue;
    if (count == kNotHeld || taken == kSlots) return {kNotHeld};
    words[taken++] = static_cast<std::uint32_t>(l) << kCountBits | count;
  }
  words[kRest] = whole_quanta(evidence.rest);
  if (words[kRest] == kNotHeld) return {kNotHeld};
  if (taken != 0 || words[kRest] != 0)
    words[kRest] |= std::uint32_t{evidence.centroid.code()} << kCountBits;
  return words;
}

OctetCentroids CompactTuple::centroids(const std::byte* octet_bytes) noexcept {
  Words rests{};
  std::memcpy(&rests, octet_bytes + kRest * sizeof(Words), sizeof(rests));
  OctetCentroids found{};
  for (std::size_t v = 0; v < kOctetVoxels; ++v)
    found[v] = Centroid::of_code(static_cast<std::uint8_t>(rests[v] >> kCountBits));
  return found;
}

void CompactTuple::condense(VoxelEvidence& evidence) const noexcept {
  const float most = static_cast<float>(kMostCount) * quantum_;
  const auto classes =
      std::span(evidence.sigma).first(static_cast<std::size_t>(evidence.num_components));
  std::array<std::size_t, kSlots> kept{};  // 0: none
  for (std::size_t l = 1; l < classes.size(); ++l) {
    std::size_t candidate = classes[l] > 0.0F ? l : 0;
    for (std::size_t& slot : kept) {
      if (candidate == 0) break;
      const bool larger = slot == 0 || classes[candidate] > classes[slot];
      // One that was displaced may be of a lower class than its equal.
      const bool lower = candidate < slot && !(classes[candidate] < classes[slot]);
      if (larger || lower) std::swap(slot, candidate);
    }
    if (candidate != 0) {
      evidence.rest += classes[candidate];
      classes[candidate] = 0.0F;
    }
  }
  for (float& count : classes.subspan(1)) count = count < most ? count : most;
  evidence.rest = evidence.rest < most ? evidence.rest : most;
}

void CompactTuple::restore(std::byte* octet_bytes, int voxel,
                           const VoxelEvidence& evidence) const noexcept {
  const std::array<std::uint32_t, kSlots + 1> words = words_of(evidence);
  TESSERA_ASSERT(words[0] != kNotHeld);
  Octet octet{};
  std::memcpy(&octet, octet_bytes, sizeof(octet));
  for (std::size_t s = 0; s <= kSlots; ++s)
    octet.words[s][static_cast<std::size_t>(voxel)] = words[s];
  store_shared_words(octet_bytes, &octet, sizeof(octet));
}

}  // namespace tessera
