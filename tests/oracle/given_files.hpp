// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Where recorded data and reference numbers lie: $TESSERA_DATA, or beside the sources. Without
// them, tests that need them say "skipped: no given data", which ctest reports as skipped. A
// $TESSERA_DATA that holds no data set is a mistake and fails them.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace tessera::oracle {

/// The path below the data folder; "../reference" is its sibling. Nothing, and the sentence above,
/// if it does not exist. Inside of a test case.
[[nodiscard]] std::optional<std::filesystem::path> given_path(const std::string& below_data);

}  // namespace tessera::oracle
