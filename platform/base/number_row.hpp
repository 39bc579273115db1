// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Rows of numbers, as in KITTI text files, read the same way in every locale.
#pragma once

#include <cstddef>
#include <string_view>

#include "base/outcome.hpp"
#include "tessera/base/geometry.hpp"

namespace tessera {

/// Most bytes of a text file that describes a dataset, and of one with a row for each scan or
/// sample.
inline constexpr std::size_t kMostDescriptionBytes = std::size_t{1} << 20U;
inline constexpr std::size_t kMostRowsBytes = std::size_t{1} << 28U;

/// Place of a row, for messages. line counts from 1.
struct TextPlace {
  std::string_view path;
  std::size_t line = 0;
};

/// "path, line n: what; remedy", always in one line.
[[nodiscard]] Failure text_failure(const TextPlace& place, std::string_view what,
                                   std::string_view remedy);

/// "path, line n: 'word' is not a number; remedy"; cuts a long word, and omits one that does not
/// begin as a number.
[[nodiscard]] Failure not_a_number(const TextPlace& place, std::string_view word,
                                   std::string_view remedy);

/// Number of lines of at least least_bytes, for reserving memory.
[[nodiscard]] std::size_t count_rows(std::string_view text, std::size_t least_bytes) noexcept;
/// Splits off the next line, without its end (LF or CRLF). text must not be empty.
[[nodiscard]] std::string_view take_line(std::string_view& text) noexcept;
/// Without the spaces and tabs around it.
[[nodiscard]] std::string_view trimmed(std::string_view text) noexcept;

/// Splits off the next word; empty at the end of the row.
[[nodiscard]] std::string_view take_word(std::string_view& row) noexcept;
/// False iff word is not a number that a double can hold, in full. A plus sign is allowed.
[[nodiscard]] bool parse_double(std::string_view word, double& value) noexcept;

/// Twelve numbers, separated by spaces or tabs, as a row-major 3x4 matrix. nan and inf are numbers:
/// whether a pose is usable is decided where it is used. Fails with kUsage iff there are fewer or
/// more numbers, or something that is not a number that a double can hold.
Outcome<Matrix34d> parse_matrix34(std::string_view row, const TextPlace& place);

}  // namespace tessera
