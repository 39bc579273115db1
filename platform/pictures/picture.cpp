// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "pictures/picture.hpp"

#include <cmath>

#include "base/atomic_file.hpp"
#include "pictures/framing.hpp"
#include "pictures/png_encoder.hpp"
#include "pictures/sheet.hpp"

namespace tessera {
namespace {

Outcome<void> check(float resolution_m, const ImageOptions& options) {
  if (!std::isfinite(resolution_m) || resolution_m <= 0.0F) {
    return Failure{"cannot draw voxels of " + std::to_string(resolution_m) +
                   " m; the resolution must be positive"};
  }
  if (options.width_px < ImageOptions::kMinWidthPx ||
      options.width_px > ImageOptions::kMaxWidthPx) {
    return Failure{"cannot draw a picture " + std::to_string(options.width_px) +
                   " pixels wide; choose " + std::to_string(ImageOptions::kMinWidthPx) + " to " +
                   std::to_string(ImageOptions::kMaxWidthPx)};
  }
  return {};
}

}  // namespace

Outcome<WriteReport> write_png(std::span<const RenderVoxel> voxels, float resolution_m,
                               const ImageOptions& options, const std::string& path) {
  if (const Outcome<void> checked = check(resolution_m, options); !checked.ok())
    return checked.failure();
  // Before the drawing, so that an invalid path is reported at once.
  Outcome<AtomicFile> file = AtomicFile::open(path);
  if (!file.ok()) return file.failure();
  const Scene scene = make_scene(voxels, resolution_m);
  const Sheet sheet = draw_sheet(scene, options);
  const Outcome<std::vector<std::byte>> encoded = encode_png(sheet.canvas);
  if (!encoded.ok()) {
    return Failure{"cannot write " + path + ": " + encoded.failure().message,
                   encoded.failure().kind};
  }
  file->write(*encoded);  // commit() reports a failure
  if (const Outcome<void> committed = file->commit(); !committed.ok()) return committed.failure();
  const std::uint64_t shown = scene.drawable - sheet.cut_off;
  return WriteReport{shown, voxels.size() - shown};
}

}  // namespace tessera
