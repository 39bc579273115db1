// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The bash completion of the command, generated from the options that CLI11 knows.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace tessera {

[[nodiscard]] std::string bash_completion(const CLI::App& app);

}  // namespace tessera
