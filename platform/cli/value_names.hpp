// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What help, manual pages and completions call the value of an option.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace tessera {

/// Names every option's value: FILE, DIR, M, on|off. An option that is in no table keeps CLI11's
/// name.
void name_values(CLI::App& app);

/// What an option's value may be, as its name says.
struct ValueKind {
  std::vector<std::string> choices{};  ///< Words that may be typed as they are.
  bool files = false;
  bool folders = false;
  std::string extension{};  ///< Of the files, ".tsm"; empty: any.
};
[[nodiscard]] ValueKind kind_of(const CLI::Option& option);

/// Whether a value follows it.
[[nodiscard]] bool is_flag(const CLI::Option& option);

/// The subcommands that --help shows, in their order.
[[nodiscard]] std::vector<const CLI::App*> shown_subcommands(const CLI::App& app);

}  // namespace tessera
