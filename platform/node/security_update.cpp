// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "node/security_update.hpp"

#include <algorithm>
#include <array>

#include "tessera/base/internal/crc32.hpp"
#include "tessera/exchange/exchange_config.hpp"

namespace tessera {

std::uint32_t exclude_digest(std::span<const std::uint32_t> robots) noexcept {
  std::array<std::uint32_t, ExchangeConfig::kMostExcluded> sorted{};
  const std::size_t given = std::min(robots.size(), sorted.size());
  std::copy_n(robots.begin(), given, sorted.begin());
  const auto given_end = sorted.begin() + static_cast<std::ptrdiff_t>(given);
  std::sort(sorted.begin(), given_end);
  const auto end = std::unique(sorted.begin(), given_end);
  std::array<std::byte, 4 * ExchangeConfig::kMostExcluded> bytes{};
  std::size_t count = 0;
  for (auto robot = sorted.begin(); robot != end; ++robot) {
    for (unsigned shift = 0; shift < 32; shift += 8)
      bytes[count++] = static_cast<std::byte>(*robot >> shift & 0xffU);
  }
  return crc32c(std::span(bytes).first(count));
}

}  // namespace tessera
