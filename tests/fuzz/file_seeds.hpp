// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Inputs for the bodies "depth_images" and "text_files" to begin with.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace tessera::fuzz {

[[nodiscard]] std::vector<std::vector<std::byte>> image_seeds();
[[nodiscard]] std::vector<std::vector<std::byte>> toml_seeds();

}  // namespace tessera::fuzz
