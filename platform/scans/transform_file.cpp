// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "scans/transform_file.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>

#include "base/input_file.hpp"
#include "base/number_row.hpp"
#include "tessera/registration/scan.hpp"

namespace tessera {

Outcome<Matrix34d> read_transform(const std::string& path) {
  constexpr std::size_t kMaxTextBytes = std::size_t{1} << 16U;
  TESSERA_TRY_ASSIGN(const std::string content, read_text_file(path, kMaxTextBytes));
  std::array<double, 16> numbers{};
  std::size_t count = 0;
  std::string_view text = content;
  for (TextPlace place{path, 1}; !text.empty(); ++place.line) {
    std::string_view line = take_line(text);
    for (std::string_view word = take_word(line); !word.empty(); word = take_word(line)) {
      double value = 0.0;
      if (!parse_double(word, value))
        return not_a_number(place, word, "write a 4x4 matrix, row by row");
      if (count < numbers.size()) numbers[count] = value;
      ++count;
    }
  }
  if (count != numbers.size()) {
    return Failure{fmt::format("{} has {} numbers instead of 16; write a 4x4 matrix, row by row",
                               path, count)};
  }
  constexpr std::array<double, 4> kLastRow{0.0, 0.0, 0.0, 1.0};
  if (!std::equal(kLastRow.begin(), kLastRow.end(), numbers.begin() + 12))
    return Failure{path + " is not a rigid transform; its last row must be 0 0 0 1"};
  Matrix34d T;
  std::copy_n(numbers.begin(), 12, T.data());
  if (check_rigid(T) != Status::kOk)
    return Failure{path + " is not a rigid transform; its first three rows must be [R | t]"};
  return T;
}

}  // namespace tessera
