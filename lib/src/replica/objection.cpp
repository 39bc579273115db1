// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/replica/objection.hpp"

#include "tessera/base/internal/bits.hpp"
#include "tessera/base/internal/byte_io.hpp"
#include "tessera/replica/contribution_kind.hpp"

namespace tessera {

namespace {

// Little-endian: robot, epoch, submap, key, version, which rows of eight voxels have one, and a
// byte for each of these rows.
constexpr int kRows = kBlockVoxels / 8;

constexpr std::uint8_t row_of(const VoxelMask& mask, int row) noexcept {
  return static_cast<std::uint8_t>(mask[static_cast<std::size_t>(row / 8)] >>
                                   static_cast<unsigned>(row % 8 * 8));
}

}  // namespace

BlockKey Objection::place_of(const ContributionId& against, BlockKey key) noexcept {
  const std::uint64_t robot = std::uint64_t{against.robot} << 32U | against.epoch;
  const auto place =
      static_cast<std::int32_t>(mix64(key.bits + mix64(against.submap + mix64(robot))) % kPlaces);
  return *pack({place & 127, place >> 7, 0});
}

std::size_t Objection::write(std::span<std::byte> into) const noexcept {
  ByteWriter to(into);
  to.u32(against.robot);
  to.u32(against.epoch);
  to.u32(against.submap);
  to.u64(key.bits);
  to.u32(version);
  std::uint64_t rows = 0;
  for (int row = 0; row < kRows; ++row)
    rows |= std::uint64_t{row_of(voxels, row) != 0 ? 1U : 0U} << static_cast<unsigned>(row);
  to.u64(rows);
  for (int row = 0; row < kRows; ++row)
    if (row_of(voxels, row) != 0) to.u8(row_of(voxels, row));
  return to.ok() ? to.size() : 0;
}

bool Objection::read(std::span<const std::byte> from) noexcept {
  ByteReader reader(from);
  against = {reader.u32(), reader.u32(), reader.u32()};
  key = {reader.u64()};
  version = reader.u32();
  const std::uint64_t rows = reader.u64();
  voxels = {};
  bool is_canonical = rows != 0 && has_blocks(against);
  for (std::uint64_t left = rows; left != 0; left &= left - 1) {
    const auto row = static_cast<unsigned>(std::countr_zero(left));
    const std::uint8_t bits = reader.u8();
    voxels[row / 8] |= std::uint64_t{bits} << (row % 8 * 8);
    is_canonical = is_canonical && bits != 0;
  }
  const Result<BlockKey> packed = pack(unpack(key));
  return is_canonical && reader.ok() && reader.remaining() == 0 && packed.ok() && *packed == key;
}

bool read_objection(const Replicas& replicas, const Replicas::Replica* record,
                    Objection& into) noexcept {
  std::array<std::byte, Objection::kMostBytes> bytes{};
  return record != nullptr && record->bytes != 0 && record->bytes <= bytes.size() &&
         into.read(replicas.read(*record, bytes));
}

bool find_objection(const Replicas& replicas, Replicas::Slot objections,
                    const ContributionId& against, BlockKey key, Objection& into) noexcept {
  return read_objection(replicas, replicas.find(objections, Objection::place_of(against, key)),
                        into) &&
         into.against == against && into.key == key;
}

}  // namespace tessera
