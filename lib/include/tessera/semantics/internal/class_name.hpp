// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Comparing names of classes, as data sets write them.
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

namespace tessera::detail {

/// Whether a name is a known one; of the name, capital letters count as small ones, "_" and spaces
/// as "-". O(letters).
[[nodiscard]] constexpr bool is_name(std::string_view name, std::string_view known) noexcept {
  bool same = name.size() == known.size();
  for (std::size_t i = 0; same && i < known.size(); ++i) {
    const char c = name[i];
    const char plain = c == '_' || c == ' ' ? '-' : c;
    same = (c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : plain) == known[i];
  }
  return same;
}

/// Whether a name is one of these. O(names).
template <std::size_t N>
[[nodiscard]] constexpr bool is_one_of(std::string_view name,
                                       const std::array<std::string_view, N>& names) noexcept {
  bool found = false;
  for (const std::string_view known : names) found = found || is_name(name, known);
  return found;
}

}  // namespace tessera::detail
