// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A rigid transform as a text file: a 4x4 matrix, row by row.
#pragma once

#include <string>

#include "base/outcome.hpp"
#include "tessera/base/geometry.hpp"

namespace tessera {

/// Fails with kUsage iff the file cannot be read, is not 16 numbers whose last four are 0 0 0 1, or
/// the first three rows are not a rigid transform.
Outcome<Matrix34d> read_transform(const std::string& path);

}  // namespace tessera
