// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Checks a text before toml++ reads it.
#pragma once

#include <fmt/core.h>

#include <cstddef>
#include <string>
#include <string_view>

#include "base/outcome.hpp"

namespace tessera {

/// Fails with kUsage, naming the line, iff a line has over 4000 dots: its keys may nest deeper than
/// the stack allows. Each dot of a key is a table within a table; toml++ does not limit them and
/// frees them by recursion, but limits nested values. name: of the text.
inline Outcome<void> check_nesting(std::string_view toml, const std::string& name) {
  constexpr std::size_t kMostDots = 4000;
  std::size_t line = 1;
  std::size_t dots = 0;
  for (const char letter : toml) {
    if (letter == '\n') {
      ++line;
      dots = 0;
    } else if (letter == '.' && ++dots > kMostDots) {
      return Failure{
          fmt::format("{}, line {}: over 4000 dots; keys of that many parts are not read; write "
                      "tables of few levels",
                      name, line)};
    }
  }
  return {};
}

}  // namespace tessera
