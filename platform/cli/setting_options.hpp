// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The rows of a table as options of a command.
#pragma once

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <string_view>
#include <vector>

#include "settings/setting.hpp"

namespace tessera {

/// "M", "on|off", "dense|compact"; words in lower case are literal.
[[nodiscard]] std::string value_name(const Setting& setting);

namespace detail {
void declare_setting(CLI::App& command, const Setting& setting, void* options);
}

/// Declares every row that has an option and is not left out, with its value, default and sentence.
/// options: must outlive the command.
template <class Options>
void declare_settings(CLI::App& command, const SettingTable<Options>& table,
                      std::type_identity_t<Options>& options,
                      std::initializer_list<std::string_view> left_out = {}) {
  for (const Setting& row : table.rows) {
    if (row.name.option.empty()) continue;
    if (std::find(left_out.begin(), left_out.end(), row.name.option) == left_out.end())
      detail::declare_setting(command, row, &options);
  }
}

/// Declares --without: raw ids of the truth whose points do not count. without: must outlive the
/// command.
void declare_without(CLI::App& command, std::vector<std::uint16_t>& without);

}  // namespace tessera
