// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "pictures/picture.hpp"

#include <fmt/core.h>

#include <cmath>

#include "base/atomic_file.hpp"
#include "pictures/framing.hpp"
#include "pictures/png_encoder.hpp"
#include "pictures/sheet.hpp"

namespace tessera {
namespace {

Outcome<void> check(float resolution_m, const ImageOptions& options) {
  if (!std::isfinite(resolution_m) || resolution_m <= 0.0F) {
    return Failure{
        fmt::format("cannot draw voxels of {} m; the resolution must be positive", resolution_m)};
  }
  if (options.width_px < ImageOptions::kMinWidthPx ||
      options.width_px > ImageOptions::kMaxWidthPx) {
    return Failure{fmt::format("cannot draw a picture {} pixels wide; choose {} to {}",
                               options.width_px, ImageOptions::kMinWidthPx,
                               ImageOptions::kMaxWidthPx)};
  }
  return {};
}

}  // namespace

Outcome<WriteReport> write_png(std::span<const RenderVoxel> voxels, float resolution_m,
                               const ImageOptions& options, const std::string& path) {
  TESSERA_TRY(check(resolution_m, options));
  // Before the drawing, so that an invalid path is reported at once.
  TESSERA_TRY_ASSIGN(AtomicFile file, AtomicFile::open(path));
  const Scene scene = make_scene(voxels, resolution_m);
  const Sheet sheet = draw_sheet(scene, options);
  const Outcome<std::vector<std::byte>> encoded = encode_png(sheet.canvas);
  if (!encoded.ok()) {
    return Failure{"cannot write " + path + ": " + encoded.failure().message,
                   encoded.failure().kind};
  }
  file.write(*encoded);  // commit() reports a failure
  TESSERA_TRY(file.commit());
  const std::uint64_t shown = scene.drawable - sheet.cut_off;
  return WriteReport{shown, voxels.size() - shown};
}

}  // namespace tessera
