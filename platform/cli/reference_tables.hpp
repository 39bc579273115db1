// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The tables of settings and counters as the pages of docs/reference have them.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace tessera {

/// Markdown: a heading and a table for each subcommand of app ("map", "key new"), for each table of
/// a node's file ("node [map]"), and for each report ("counters scan").
[[nodiscard]] std::string reference_tables(const CLI::App& app);

}  // namespace tessera
