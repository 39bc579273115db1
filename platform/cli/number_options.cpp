// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/number_options.hpp"

namespace tessera {

CLI::Validator decimal_number() {
  const auto check = [](std::string& text) -> std::string {
    double value = 0.0;
    const char* const end = text.data() + text.size();
    const auto [stopped, error] = std::from_chars(text.data(), end, value);
    return error == std::errc{} && stopped == end ? "" : text + " is not a number";
  };
  return {check, "", "decimal number"};
}

}  // namespace tessera
