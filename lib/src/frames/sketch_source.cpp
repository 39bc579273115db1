// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/frames/sketch_source.hpp"

namespace tessera {

namespace {

/// Named, so that the gate of the stack knows who calls it.
bool take_of_map(const void* context, SketchSource::Cursor& cursor, MapSketch& sketch) noexcept {
  constexpr std::size_t kEntries = 16;
  const LocalMap& map = *static_cast<const LocalMap*>(context);
  const std::size_t looked =
      map.visit_blocks(cursor.sweep, kEntries, [&](BlockKey, SlabHandle handle) {
        sketch.add(map, handle);
        return true;
      });
  cursor.taken += looked;
  return looked == 0 || cursor.taken >= map.index().slots();
}

}  // namespace

SketchSource sketch_source_of(const LocalMap& map) noexcept {
  return {&map, map.lattice().resolution_m(), take_of_map};
}

}  // namespace tessera
