// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Writes a canvas as an 8-bit RGB PNG.
#pragma once

#include "render/canvas.hpp"
#include "render/target_file.hpp"

namespace tessera {

/// Appends the picture to the file. Fails with kFailure iff the encoder or the file does; the
/// caller then drops the file.
Outcome<void> encode_png(const Canvas& canvas, TargetFile& file);

}  // namespace tessera
