// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "base/number_text.hpp"

#include <fmt/core.h>

#include <array>
#include <charconv>
#include <cstdio>
#include <system_error>

namespace tessera {

std::string text_of(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%g", value);
  return text.data();
}

std::string nine_digits(double value) { return fmt::format("{:.9g}", value); }

double decimal_of(float value) {
  std::array<char, 32> text{};
  char* const end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  double decimal = static_cast<double>(value);
  std::from_chars(text.data(), end, decimal);
  return decimal;
}

std::optional<std::size_t> parse_bytes(const std::string& text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || !(value >= 0.0)) return std::nullopt;
  std::string unit(end, text.data() + text.size());
  if (!unit.empty() && (unit.back() == 'B' || unit.back() == 'b')) unit.pop_back();
  double factor = 1.0;
  if (unit == "K" || unit == "k")
    factor = 1024.0;
  else if (unit == "M" || unit == "m")
    factor = 1024.0 * 1024.0;
  else if (unit == "G" || unit == "g")
    factor = 1024.0 * 1024.0 * 1024.0;
  else if (!unit.empty())
    return std::nullopt;
  if (value * factor > 1e15) return std::nullopt;
  return static_cast<std::size_t>(value * factor);
}

std::string counted(std::uint64_t count, std::string_view singular) {
  std::string text = fmt::format("{} ", count);
  text.append(singular);
  return count == 1 ? text : text + "s";
}

}  // namespace tessera
