// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "view/voxel_message.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "tessera/semantics/estimate.hpp"

namespace tessera {

namespace {

constexpr std::uint32_t kMagic = 0x31565354;  // "TSV1"

template <class Integer>
void put(std::byte*& at, Integer value) noexcept {
  static_assert(std::endian::native == std::endian::little);
  std::memcpy(at, &value, sizeof value);
  at += sizeof value;
}

/// Bits of a row along y and of one along x, in a plane of constant z.
constexpr std::uint64_t kFirstRow = 0xffU;
constexpr std::uint64_t kFirstColumn = 0x0101010101010101U;

/// Voxels hidden by occupied voxels on all six sides; voxels beyond the block hide nothing.
std::uint64_t hidden(const VoxelMask& occupied, std::size_t z) noexcept {
  if (z == 0 || z + 1 == occupied.size()) return 0;
  const std::uint64_t plane = occupied[z];
  const std::uint64_t before_x = (plane << 1U) & ~kFirstColumn;
  const std::uint64_t after_x = (plane >> 1U) & ~(kFirstColumn << 7U);
  const std::uint64_t before_y = plane << 8U & ~kFirstRow;
  const std::uint64_t after_y = plane >> 8U;
  return before_x & after_x & before_y & after_y & occupied[z - 1] & occupied[z + 1];
}

struct CodedVoxel {
  std::uint8_t label = 0;
  std::uint8_t probability = 0;
  std::uint8_t variance = 0;
};

}  // namespace

void put_view_header(const ViewHeader& header, std::span<std::byte> into) noexcept {
  std::byte* at = into.data();
  put(at, kMagic);
  put(at, header.map);
  put(at, header.session);
  put(at, header.next.since);
  put(at, header.next.round);
  put(at, header.next.key);
  put(at, header.next.page);
  put(at, std::uint32_t{0});
  put(at, header.next.blocks);
  put(at, header.blocks);
  put(at, std::uint32_t{header.round_is_over ? 1U : 0U} | (header.deferred ? 2U : 0U));
  put(at, std::uint32_t{0});
}

std::uint8_t variance_code(double variance) noexcept {
  constexpr double kSteps = 40.0;
  if (!(variance > 0.0)) return 255;
  return static_cast<std::uint8_t>(
      std::clamp(std::round(-kSteps * std::log10(variance)), 0.0, 255.0));
}

std::uint8_t probability_code(double probability) noexcept {
  return static_cast<std::uint8_t>(std::round(255.0 * std::clamp(probability, 0.0, 1.0)));
}

EncodedBlock put_view_block(const BlockSnapshot& block, const Reading& reading,
                            std::uint64_t moving, const BlockMarks* marks,
                            std::span<std::byte> into) noexcept {
  VoxelMask occupied{};
  VoxelMask moved{};
  std::array<CodedVoxel, kBlockVoxels> coded;
  for (int octet = 0; octet < kBlockOctets; ++octet) {
    for (unsigned left = block.observed_labels(octet); left != 0; left &= left - 1) {
      const int voxel = std::countr_zero(left);
      const Estimate e = estimate(block.evidence(octet, voxel), reading);
      const bool is_occupied = e.state == VoxelState::kOccupied;
      if (!is_occupied && (moving >> static_cast<unsigned>(e.label) & 1U) == 0) continue;
      const auto row = static_cast<std::size_t>(row_order(octet, voxel));
      (is_occupied ? occupied : moved)[row / 64] |= std::uint64_t{1} << (row % 64);
      coded[row] = {static_cast<std::uint8_t>(e.label), probability_code(e.probability),
                    variance_code(e.variance)};
    }
  }
  EncodedBlock result;
  std::byte* at = into.data() + kViewBlockBytes;
  for (std::size_t z = 0; z < occupied.size(); ++z) {
    for (std::uint64_t left = (occupied[z] & ~hidden(occupied, z)) | moved[z]; left != 0;
         left &= left - 1) {
      const std::size_t row = 64 * z + static_cast<std::size_t>(std::countr_zero(left));
      const VoxelMark mark = marks == nullptr ? VoxelMark{} : (*marks)[row];
      put(at, static_cast<std::uint16_t>(row));
      put(at, coded[row].label);
      put(at, coded[row].probability);
      put(at, coded[row].variance);
      put(at, mark.contributor);
      put(at, static_cast<std::uint8_t>((mark.disagreement ? kViewDisagreement : 0) |
                                        (has_row(moved, static_cast<int>(row)) ? kViewMoved : 0)));
      put(at, std::uint8_t{0});
      ++result.voxels;
    }
  }
  std::byte* head = into.data();
  put(head, block.coord().x);
  put(head, block.coord().y);
  put(head, block.coord().z);
  put(head, block.revision());
  put(head, result.voxels);
  result.bytes = kViewBlockBytes + kViewVoxelBytes * result.voxels;
  return result;
}

}  // namespace tessera
