// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The tables of settings as the pages of docs/reference have them.
#pragma once

#include <string>

namespace tessera {

/// Markdown: a heading and a table for "map", and for each table of a node's file ("node [map]").
[[nodiscard]] std::string reference_tables();

}  // namespace tessera
