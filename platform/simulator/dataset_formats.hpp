// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The text and the bytes of dataset files.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "simulator/street_simulator.hpp"

namespace tessera::street {

/// Little-endian float32 and uint32.
std::string point_bytes(const std::vector<std::array<float, 4>>& points);
std::string number_bytes(const std::vector<float>& numbers);
std::string label_bytes(const std::vector<std::uint32_t>& labels);

/// Six digits.
std::string scan_name(int index);

/// Independent of the locale; reads back as the same double.
std::string text_of(double number);

/// The upper rows of a pose matrix, numbers separated by spaces, ended by a newline.
std::string rows_text(const Eigen::Isometry3d& pose, int rows, char between_rows);

/// cameras.toml for images in cameras/0, cameras/1, ...
std::string cameras_toml(const std::vector<SimulatedCamera>& cameras);

}  // namespace tessera::street
