// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The options of "map" on the command line.
#pragma once

#include <CLI/CLI.hpp>

#include "settings/map_options.hpp"

namespace tessera {

void declare_map_options(CLI::App& command, MapOptions& options);

}  // namespace tessera
