// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Where a map's sketch comes from: a map, or what has arrived of one.
#pragma once

#include "tessera/frames/map_sketch.hpp"

namespace tessera {

/// A map that a sketch is taken from in pieces. It owns nothing: what context points to must stay
/// where it is until all is taken.
struct SketchSource {
  /// How far it is taken. A default one begins at the first piece; what its members mean is the
  /// source's.
  struct Cursor {
    SweepCursor sweep;      ///< Of a map's index.
    std::size_t taken = 0;  ///< Entries so far.
  };

  const void* context = nullptr;
  double resolution_m = 0.0;  ///< Of the map: edge of a voxel.
  /// Adds the blocks of the next piece to a sketch of this resolution, each block once, and moves
  /// the cursor on. True iff all is taken; not called again then.
  bool (*take)(const void* context, Cursor& cursor, MapSketch& sketch) noexcept = nullptr;
  /// take() begins the sketch itself, or brings it up to date where it took it before
  /// (MapSketch::owner).
  bool keeps = false;
};

/// A map, which must stay as it is until all is taken. A piece is 16 entries of its index, with the
/// blocks among them: at most 16 times MapSketch::add.
[[nodiscard]] SketchSource sketch_source_of(const LocalMap& map) noexcept;

}  // namespace tessera
