// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Manual pages in roff, generated from the options that CLI11 knows.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace tessera {

/// tessera(1).
[[nodiscard]] std::string manual_page(const CLI::App& app);
/// tessera-NAME(1), including its own subcommands.
[[nodiscard]] std::string manual_page_of(const CLI::App& command);

}  // namespace tessera
