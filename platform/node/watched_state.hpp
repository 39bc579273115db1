// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Places that others have and this robot may see through, from the thread that shares to the one
// that maps, and back with what the scan told.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "tessera/robot/objections.hpp"

namespace tessera {

/// Bytes that may be copied.
struct WatchedState {
  std::uint32_t count = 0;
  std::uint32_t submap = 0;   ///< In whose frame they are; from the scan, that it was mapped into.
  std::int64_t taken_us = 0;  ///< Of the scan.
  std::array<WatchedPoint, Objections::kMostPoints> points{};

  [[nodiscard]] std::span<WatchedPoint> all() noexcept { return std::span(points).first(count); }
};

}  // namespace tessera
