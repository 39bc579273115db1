// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "oracle/given_files.hpp"

#include <catch2/catch.hpp>
#include <cstdlib>

namespace tessera::oracle {

std::optional<std::filesystem::path> given_path(const std::string& below_data) {
  const char* given = std::getenv("TESSERA_DATA");
  const std::filesystem::path root = given != nullptr ? given : TESSERA_DATA_BESIDE_SOURCES;
  const std::filesystem::path path = root / below_data;
  if (std::filesystem::exists(path)) return path;
  if (given != nullptr && !std::filesystem::exists(root / "semantickitti_08")) {
    FAIL("TESSERA_DATA is " << root.string() << ", which does not hold semantickitti_08");
  }
  WARN("skipped: no given data: " << path.string() << " is not there; set TESSERA_DATA");
  return std::nullopt;
}

}  // namespace tessera::oracle
