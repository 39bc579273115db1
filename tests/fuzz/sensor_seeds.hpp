// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Inputs for the bodies "sensors" and "status", and for statements about frames in "wire", to begin
// with.
#pragma once

#include <cstddef>
#include <vector>

namespace tessera::fuzz {

[[nodiscard]] std::vector<std::vector<std::byte>> sensor_seeds();
[[nodiscard]] std::vector<std::vector<std::byte>> status_seeds();
[[nodiscard]] std::vector<std::vector<std::byte>> frame_seeds();

}  // namespace tessera::fuzz
