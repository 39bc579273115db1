// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "fuzz/fuzz.hpp"

#include <algorithm>

namespace tessera::fuzz {

std::uint8_t Input::u8() {
  if (rest_.empty()) return 0;
  const auto value = std::to_integer<std::uint8_t>(rest_[0]);
  rest_ = rest_.subspan(1);
  return value;
}

std::uint16_t Input::u16() {
  const unsigned low = u8();
  const unsigned high = u8();
  return static_cast<std::uint16_t>(low | high << 8U);
}

std::uint32_t Input::u32() {
  const std::uint32_t low = u16();
  const std::uint32_t high = u16();
  return low | high << 16U;
}

Bytes Input::bytes(std::size_t count) {
  const Bytes taken = rest_.first(std::min(count, rest_.size()));
  rest_ = rest_.subspan(taken.size());
  return taken;
}

}  // namespace tessera::fuzz
