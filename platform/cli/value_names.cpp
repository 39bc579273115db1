// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/value_names.hpp"

#include <algorithm>
#include <cctype>
#include <string_view>

namespace tessera {

namespace {

bool is_word(std::string_view text) {
  return !text.empty() && std::islower(static_cast<unsigned char>(text.front())) != 0;
}

}  // namespace

bool is_flag(const CLI::Option& option) { return option.get_items_expected_max() == 0; }

ValueKind kind_of(const CLI::Option& option) {
  const std::string name = option.get_type_name();
  ValueKind kind;
  for (std::size_t begin = 0; begin <= name.size();) {
    const std::size_t end = std::min(name.find('|', begin), name.size());
    const std::string part = name.substr(begin, end - begin);
    begin = end + 1;
    if (is_word(part)) {
      kind.choices.push_back(part);
    } else if (part == "DIR") {
      kind.folders = true;
    } else if (part == "FILE" || part.find('=') != std::string::npos) {
      kind.files = true;
    } else if (const std::size_t dot = part.find('.'); dot != std::string::npos) {
      kind.files = true;
      kind.extension = part.substr(dot);
    }
  }
  return kind;
}

std::vector<const CLI::App*> shown_subcommands(const CLI::App& app) {
  std::vector<const CLI::App*> shown;
  for (const CLI::App* const command : app.get_subcommands([](const CLI::App*) { return true; }))
    if (!command->get_group().empty()) shown.push_back(command);
  return shown;
}

}  // namespace tessera
