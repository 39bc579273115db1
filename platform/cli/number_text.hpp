// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Numbers as people type them, checked before they are converted, and as they are written back.
#pragma once

#include <CLI/CLI.hpp>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>

namespace tessera {

/// Accepts decimal digits that T can hold, with a minus sign where T has one; nothing is clamped.
template <class T>
CLI::Validator whole_number() {
  const auto check = [](std::string& text) -> std::string {
    T value{};
    const char* const end = text.data() + text.size();
    const auto [stopped, error] = std::from_chars(text.data(), end, value);
    if (error == std::errc{} && stopped == end) return "";
    return text + " is not a whole number from " + std::to_string(std::numeric_limits<T>::min()) +
           " to " + std::to_string(std::numeric_limits<T>::max());
  };
  return {check, "", "whole number"};
}

/// Accepts decimal numbers that a double can hold, nan and inf among them: the ranges are checked
/// where the options are used.
CLI::Validator decimal_number();

/// As a person would type the number.
std::string text_of(double value);

/// The number that somebody typed who got this float: the shortest decimal text for it, as a
/// double.
double decimal_of(float value);

/// Bytes of "512M" and the like: a number alone, or with K, M, G, which are powers of 1024. Nothing
/// if it is no such text, negative, or over 10^15.
std::optional<std::size_t> parse_bytes(const std::string& text);

/// "1 scan", "2 scans".
std::string counted(std::uint64_t count, std::string_view singular);

}  // namespace tessera
