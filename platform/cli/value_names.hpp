// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What the values of options may be, for manual pages and completions.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace tessera {

/// What the value of an option may be, by its name.
struct ValueKind {
  std::vector<std::string> choices{};  ///< Literal words.
  bool files = false;
  bool folders = false;
  std::string extension{};  ///< Of the files, ".tsm"; empty: any.
};
[[nodiscard]] ValueKind kind_of(const CLI::Option& option);

/// True if a value follows it.
[[nodiscard]] bool is_flag(const CLI::Option& option);

/// The subcommands that --help shows, in their order.
[[nodiscard]] std::vector<const CLI::App*> shown_subcommands(const CLI::App& app);

}  // namespace tessera
