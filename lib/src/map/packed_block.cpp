// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/map/internal/packed_block.hpp"

namespace tessera {

namespace {

/// Writes words one after the other; what does not fit is dropped and ok turns false.
struct Packer {
  std::span<std::byte> into;
  std::size_t size = 0;
  bool ok = true;

  template <class Word>
  void put(Word word) noexcept {
    static_assert(std::endian::native == std::endian::little);
    if (into.size() - size < sizeof(word)) {
      ok = false;
      return;
    }
    std::memcpy(&into[size], &word, sizeof(word));
    size += sizeof(word);
  }
};

/// A voxel's entries; at most so many as there are label components and the rest.
std::uint32_t entries_of(const BlockContent& content, int row,
                         std::array<std::uint32_t, kMaxComponents>& entries) noexcept {
  std::uint32_t count = 0;
  const auto note = [&](std::uint32_t component, float value) {
    const std::uint32_t bits = detail::short_float(value);
    if (bits != 0) entries[count++] = component << 25U | bits;
  };
  for (std::uint64_t rest = content.components(); rest != 0; rest &= rest - 1) {
    const int component = std::countr_zero(rest);
    note(static_cast<std::uint32_t>(component), content.count(component, row));
  }
  if (content.any_rest()) note(0, content.rest(row));
  if (count != 0) entries[count - 1] |= std::uint32_t{1} << 31U;
  return count;
}

unsigned pack_octet(const BlockContent& content, int corner, Packer& packer) noexcept {
  unsigned voxels = 0;
  std::uint8_t known = 0;
  const std::size_t at = packer.size;
  packer.put(known);
  std::array<std::uint32_t, kMaxComponents> entries{};
  for (int v = 0; v < kOctetVoxels; ++v) {
    const int row = corner + row_order(0, v);
    const std::uint32_t count = entries_of(content, row, entries);
    if (count == 0) continue;
    voxels |= 1U << static_cast<unsigned>(v);
    if (content.centroid(row).known()) {
      known |= static_cast<std::uint8_t>(1U << static_cast<unsigned>(v));
      packer.put(content.centroid(row).code());
    }
    for (std::uint32_t i = 0; i < count; ++i) packer.put(entries[i]);
  }
  if (packer.ok) packer.into[at] = std::byte{known};
  if (voxels == 0 && packer.ok) packer.size = at;
  return voxels;
}

void pack_passes(const BlockContent& content, std::uint64_t octets, Packer& packer) noexcept {
  const std::size_t at = packer.size;
  std::uint64_t uniform = 0;
  packer.put(uniform);
  for (; octets != 0; octets &= octets - 1) {
    const int octet = std::countr_zero(octets);
    std::array<std::uint8_t, kOctetVoxels> passes{};
    bool same = true;
    for (int v = 0; v < kOctetVoxels; ++v) {
      const unsigned count = content.passes(row_order(octet, v));
      passes[static_cast<std::size_t>(v)] = static_cast<std::uint8_t>(count < 255U ? count : 255U);
      same = same && passes[static_cast<std::size_t>(v)] == passes[0];
    }
    if (same) {
      uniform |= octets & (~octets + 1);
      packer.put(passes[0]);
    } else {
      packer.put(passes);
    }
  }
  if (packer.ok) std::memcpy(&packer.into[at], &uniform, sizeof(uniform));
}

}  // namespace

std::size_t pack_block(const BlockContent& content, std::span<std::byte> into) noexcept {
  if (into.size() < 16) return 0;
  Packer packer{into};
  // Masks before entries, whose octets are known only then: room for all candidates, moved up.
  const std::uint64_t candidates = content.label_octets();
  std::array<std::uint8_t, kBlockOctets> masks{};
  packer.size = 16 + static_cast<std::size_t>(count_ones(candidates));
  if (packer.size > into.size()) return 0;
  const std::size_t entries_at = packer.size;
  std::uint64_t labelled = 0;
  std::size_t octets = 0;
  for (std::uint64_t rest = candidates; rest != 0; rest &= rest - 1) {
    const unsigned voxels = pack_octet(content, row_order_corner(std::countr_zero(rest)), packer);
    if (voxels == 0) continue;
    labelled |= rest & (~rest + 1);
    masks[octets++] = static_cast<std::uint8_t>(voxels);
  }
  std::memmove(&into[16 + octets], into.data() + entries_at, packer.size - entries_at);
  std::memcpy(into.data() + 16, masks.data(), octets);
  packer.size -= entries_at - 16 - octets;
  const std::uint64_t passed = content.pass_octets();
  if (passed != 0) pack_passes(content, passed, packer);
  std::memcpy(into.data(), &labelled, sizeof(labelled));
  std::memcpy(into.data() + 8, &passed, sizeof(passed));
  return packer.ok && (labelled | passed) != 0 ? packer.size : 0;
}

void add_block(const LocalMap& map, const Block& block, BlockContent& content) noexcept {
  for (std::uint64_t octets = map.octets_of(block); octets != 0; octets &= octets - 1) {
    const int octet = std::countr_zero(octets);
    const OctetCentroids centroids = map.centroids(block, octet);
    for (unsigned voxels = map.observed_labels(block, octet); voxels != 0; voxels &= voxels - 1) {
      const int v = std::countr_zero(voxels);
      const int row = row_order(octet, v);
      map.visit_labels(
          block, octet, v, [&](int component, float count) { content.add(component, row, count); },
          [&](float rest) { content.add_rest(row, rest); });
      content.add_centroid(row, centroids[static_cast<std::size_t>(v)]);
    }
  }
  if (!block.has_free_passes()) return;
  std::array<std::byte, kBlockVoxels> passes{};
  copy_passes(map, block, passes);
  for (int i = 0; i < kBlockVoxels; ++i) {
    const auto count = std::to_integer<unsigned>(passes[static_cast<std::size_t>(i)]);
    if (count != 0) content.add_passes(row_order(i / kOctetVoxels, i % kOctetVoxels), count);
  }
}

void add_block(const BlockSnapshot& block, BlockContent& content) noexcept {
  for (int octet = 0; octet < kBlockOctets; ++octet) {
    const OctetCentroids centroids = block.centroids(octet);
    for (unsigned voxels = block.observed_labels(octet); voxels != 0; voxels &= voxels - 1) {
      const int v = std::countr_zero(voxels);
      const int row = row_order(octet, v);
      block.visit_labels(
          octet, v, [&](int component, float count) { content.add(component, row, count); },
          [&](float rest) { content.add_rest(row, rest); });
      content.add_centroid(row, centroids[static_cast<std::size_t>(v)]);
    }
    for (int v = 0; v < kOctetVoxels; ++v) {
      const unsigned count = block.free_passes(octet, v);
      if (count != 0) content.add_passes(row_order(octet, v), count);
    }
  }
}

namespace {

/// Where the entries of a voxel end, or nullptr: they do not, or are no entries.
const std::byte* end_of_voxel(const std::byte* at, const std::byte* end, bool has_centroid,
                              int num_components) noexcept {
  if (has_centroid) {
    if (at == end || *at == std::byte{0} || std::to_integer<int>(*at) >= Centroid::kCodes)
      return nullptr;
    ++at;
  }
  // Components ascend; the rest, as 0, comes last.
  std::uint32_t least = 1;
  for (bool more = true; more; at += 4) {
    if (end - at < 4) return nullptr;
    const auto entry = detail::load_word<std::uint32_t>(at);
    const std::uint32_t component = (entry >> 25U) & 63U;
    const std::uint32_t bits = entry & 0x1ffffffU;
    more = entry >> 31U == 0;
    const bool rest_last = component == 0 && !more;
    const bool ascends =
        component >= least && component < static_cast<std::uint32_t>(num_components);
    if (bits < detail::kLeastShort || bits > detail::kLargestShort || !(rest_last || ascends))
      return nullptr;
    least = component + 1;
  }
  return at;
}

/// Whether the bytes from at on are the passes of these octets, and nothing else.
bool are_passes(const std::byte* at, const std::byte* end, std::uint64_t octets) noexcept {
  if (octets == 0) return at == end;
  if (end - at < 8) return false;
  const auto uniform = detail::load_word<std::uint64_t>(at);
  at += 8;
  if ((uniform & ~octets) != 0) return false;
  for (; octets != 0; octets &= octets - 1) {
    const bool same = (uniform & octets & (~octets + 1)) != 0;
    const std::ptrdiff_t size = same ? 1 : kOctetVoxels;
    if (end - at < size) return false;
    bool any = false;
    bool differ = same;
    for (std::ptrdiff_t i = 0; i < size; ++i) {
      any = any || at[i] != std::byte{0};
      differ = differ || at[i] != at[0];
    }
    if (!any || !differ) return false;
    at += size;
  }
  return at == end;
}

}  // namespace

Status check_packed(std::span<const std::byte> bytes, int num_components) noexcept {
  if (bytes.size() < 16) return Status::kCorrupt;
  const auto labelled = detail::load_word<std::uint64_t>(bytes.data());
  const auto passed = detail::load_word<std::uint64_t>(bytes.data() + 8);
  const auto octets = static_cast<std::size_t>(count_ones(labelled));
  if ((labelled | passed) == 0 || bytes.size() < 16 + octets) return Status::kCorrupt;
  const std::byte* at = bytes.data() + 16 + octets;
  const std::byte* const end = bytes.data() + bytes.size();
  for (std::size_t i = 0; i < octets; ++i) {
    auto voxels = std::to_integer<unsigned>(bytes[16 + i]);
    if (voxels == 0 || at == end) return Status::kCorrupt;
    const auto known = std::to_integer<unsigned>(*at++);
    if ((known & ~voxels) != 0) return Status::kCorrupt;
    for (; voxels != 0; voxels &= voxels - 1) {
      const bool has_centroid = (known & voxels & (~voxels + 1)) != 0;
      at = end_of_voxel(at, end, has_centroid, num_components);
      if (at == nullptr) return Status::kCorrupt;
    }
  }
  return are_passes(at, end, passed) ? Status::kOk : Status::kCorrupt;
}

}  // namespace tessera
