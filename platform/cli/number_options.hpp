// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Numbers of the command line, checked before they are converted.
#pragma once

#include <CLI/CLI.hpp>
#include <charconv>
#include <limits>
#include <string>
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

}  // namespace tessera
