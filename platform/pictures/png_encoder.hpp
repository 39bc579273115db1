// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Encodes a canvas as an 8-bit RGB PNG.
#pragma once

#include <cstddef>
#include <vector>

#include "base/outcome.hpp"
#include "pictures/canvas.hpp"

namespace tessera {

/// The bytes of the file. Fails with kFailure iff the encoder does.
Outcome<std::vector<std::byte>> encode_png(const Canvas& canvas);

}  // namespace tessera
