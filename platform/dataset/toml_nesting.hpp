// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What is asked of a text before toml++ reads it.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "posix/outcome.hpp"

namespace tessera {

/// Fails with kUsage, naming the line, iff a line has over 4000 dots: its keys may nest deeper than
/// the stack bears. Each dot of a key is a table within a table, of which toml++ has no limit, and
/// frees them by recursion; values in values it bounds. name: what the text is of.
inline Outcome<void> check_nesting(std::string_view toml, const std::string& name) {
  constexpr std::size_t kMostDots = 4000;
  std::size_t line = 1;
  std::size_t dots = 0;
  for (const char letter : toml) {
    if (letter == '\n') {
      ++line;
      dots = 0;
    } else if (letter == '.' && ++dots > kMostDots) {
      return Failure{name + ", line " + std::to_string(line) +
                     ": over 4000 dots, and keys of so many parts are not read; write tables of "
                     "few levels"};
    }
  }
  return {};
}

}  // namespace tessera
