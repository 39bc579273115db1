// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "base/number_row.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <string>
#include <system_error>

namespace tessera {
namespace {

constexpr std::size_t kNumbers = 12;
constexpr std::string_view kBlanks = " \t\r";

}  // namespace

Failure text_failure(const TextPlace& place, std::string_view what, std::string_view remedy) {
  std::string message(place.path);
  message.append(", line ").append(std::to_string(place.line)).append(": ");
  message.append(one_line(what)).append("; ").append(remedy);
  return {std::move(message)};
}

Failure not_a_number(const TextPlace& place, std::string_view word, std::string_view remedy) {
  constexpr std::size_t kShownBytes = 16;
  // A word that does not begin as a number may be private content of another file, so it is not
  // quoted.
  if (word.find_first_of("0123456789+-.") != 0)
    return text_failure(place, "a word is not a number", remedy);
  std::string what("'");
  what.append(word.substr(0, kShownBytes)).append("' is not a number");
  return text_failure(place, what, remedy);
}

std::size_t count_rows(std::string_view text, std::size_t least_bytes) noexcept {
  std::size_t rows = 0;
  while (!text.empty()) rows += take_line(text).size() >= least_bytes ? 1U : 0U;
  return rows;
}

std::string_view take_line(std::string_view& text) noexcept {
  const std::size_t end = std::min(text.find('\n'), text.size());
  std::string_view line = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

std::string_view trimmed(std::string_view text) noexcept {
  text.remove_prefix(std::min(text.find_first_not_of(kBlanks), text.size()));
  return text.substr(0, text.find_last_not_of(kBlanks) + 1);
}

std::string_view take_word(std::string_view& row) noexcept {
  row.remove_prefix(std::min(row.find_first_not_of(kBlanks), row.size()));
  const std::string_view word = row.substr(0, row.find_first_of(kBlanks));
  row.remove_prefix(word.size());
  return word;
}

bool parse_double(std::string_view word, double& value) noexcept {
  // from_chars accepts no plus sign, but "+-1" must not be accepted either.
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
  const char* const end = word.data() + word.size();
  const auto [stopped, error] = std::from_chars(word.data(), end, value);
  return error == std::errc{} && stopped == end;
}

Outcome<Matrix34d> parse_matrix34(std::string_view row, const TextPlace& place) {
  Matrix34d matrix;
  std::size_t count = 0;
  for (std::string_view word = take_word(row); !word.empty(); word = take_word(row)) {
    double value = 0.0;
    if (!parse_double(word, value)) {
      return not_a_number(place, word, "write twelve numbers, separated by spaces");
    }
    if (count < kNumbers) matrix.data()[count] = value;
    ++count;
  }
  if (count == kNumbers) return matrix;
  return text_failure(place, fmt::format("{} numbers instead of 12", count),
                      "write the 3x4 matrix [R | t] row by row");
}

}  // namespace tessera
