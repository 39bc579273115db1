// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What the publisher's units share: a tick at work, and what its index says of a block.
#pragma once

#include "tessera/exchange/publisher.hpp"

namespace tessera {

/// A tick at work.
struct Publisher::Tick {
  MapReader map;
  const PublisherBudget& budget;
  const Publication& publication;
  std::int64_t now_us = 0;
  std::int64_t length_us = 0;  ///< As long as the last one, about.
  bool light = false;          ///< Little waits: what differs at all is published.
  bool spare = false;          ///< Half of the budget does for all that waits.
  PublisherReport report{};

  [[nodiscard]] bool has_label_bytes() const noexcept {
    return report.bytes.labels < budget.label_bytes;
  }
  [[nodiscard]] bool has_free_bytes() const noexcept {
    return report.bytes.free < budget.free_bytes;
  }
};

/// The index's value: of a block that waits its candidate; of one that does not, how many voxels
/// with label evidence it had when it was published.
inline constexpr std::uint32_t kWaits = std::uint32_t{1} << 31U;
constexpr bool is_waiting(std::uint32_t value) noexcept { return (value & kWaits) != 0; }
constexpr std::uint32_t number_of(std::uint32_t value) noexcept { return value & ~kWaits; }

}  // namespace tessera
