// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Where recorded data and reference numbers lie: $TESSERA_DATA, or beside the sources. Tests that
// need them pass without them, with a warning.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace tessera::oracle {

/// The path below the data folder; "../reference" is its sibling. Nothing, and a warning, if it
/// does not exist.
[[nodiscard]] std::optional<std::filesystem::path> given_path(const std::string& below_data);

}  // namespace tessera::oracle
