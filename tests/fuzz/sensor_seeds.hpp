// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Inputs for the bodies "sensors" and "status" to begin with.
#pragma once

#include <cstddef>
#include <vector>

namespace tessera::fuzz {

[[nodiscard]] std::vector<std::vector<std::byte>> sensor_seeds();
[[nodiscard]] std::vector<std::vector<std::byte>> status_seeds();

}  // namespace tessera::fuzz
