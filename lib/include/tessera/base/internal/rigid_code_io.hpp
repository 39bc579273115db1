// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The 22 bytes of a RigidCode, as files and datagrams have them.
#pragma once

#include "tessera/base/internal/byte_io.hpp"
#include "tessera/base/rigid_code.hpp"

namespace tessera {

inline void write_rigid_code(ByteWriter& to, const RigidCode& code) noexcept {
  for (const std::int32_t part : code.translation) to.i32(part);
  // A part of a rotation takes 24 bits.
  for (const std::int32_t part : code.rotation) {
    to.u16(static_cast<std::uint16_t>(static_cast<std::uint32_t>(part) & 0xffffU));
    to.u8(static_cast<std::uint8_t>(static_cast<std::uint32_t>(part) >> 16U & 0xffU));
  }
  to.u8(code.largest);
}

/// It may be one that decode_rigid() refuses.
[[nodiscard]] inline RigidCode read_rigid_code(ByteReader& from) noexcept {
  RigidCode code;
  for (std::int32_t& part : code.translation) part = from.i32();
  for (std::int32_t& part : code.rotation) {
    const std::uint32_t low = from.u16();
    const std::uint32_t high = from.u8();
    part = static_cast<std::int32_t>((high << 24U | low << 8U)) >> 8;
  }
  code.largest = from.u8();
  return code;
}

}  // namespace tessera
