// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "pictures/ply.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/atomic_file.hpp"
#include "pictures/ply_mesh.hpp"
#include "pictures/ply_stream.hpp"

namespace tessera {
namespace {

/// Comments on the properties of a point beyond position and colour.
std::string estimate_comments(std::span<const std::string> label_names) {
  std::string text =
      "comment label: the most likely class; probability, variance: of that class\n"
      "comment evidence: the sum of all counts, free and unlabelled ones too\n";
  for (std::size_t label = 0; label < label_names.size(); ++label) {
    if (label_names[label].empty()) continue;
    text += fmt::format("comment label {} ", label);
    // A comment ends with its line.
    for (const char c : label_names[label]) text += c == '\n' || c == '\r' ? ' ' : c;
    text += '\n';
  }
  return text;
}

std::string header_start(std::uint64_t vertices, const std::string& comments = {}) {
  return fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment voxels of a tessera map, metres, map "
      "frame\n{}element vertex {}\nproperty float x\nproperty float y\nproperty float z\nproperty "
      "uchar red\nproperty uchar green\nproperty uchar blue\n",
      comments, vertices);
}

void put_color(PlyStream& stream, Color color) {
  stream.put(color.r);
  stream.put(color.g);
  stream.put(color.b);
}

WriteReport write_points(std::span<const PlyVoxel> voxels, AtomicFile& file,
                         std::span<const std::string> label_names) {
  WriteReport report;
  for (const PlyVoxel& voxel : voxels) report.voxels += is_finite(voxel) ? 1U : 0U;
  report.left_out = voxels.size() - report.voxels;
  const bool robots = std::any_of(voxels.begin(), voxels.end(),
                                  [](const PlyVoxel& voxel) { return voxel.robots != 0; });
  PlyStream stream(file);
  stream.text(header_start(report.voxels, estimate_comments(label_names)) +
              "property uchar label\nproperty float probability\nproperty float variance\n"
              "property float evidence\n" +
              (robots ? "property uchar robots\n" : "") + "end_header\n");
  for (const PlyVoxel& voxel : voxels) {
    if (!is_finite(voxel)) continue;
    stream.put(voxel.x);
    stream.put(voxel.y);
    stream.put(voxel.z);
    put_color(stream, voxel.color);
    stream.put(voxel.label);
    stream.put(voxel.probability);
    stream.put(voxel.variance);
    stream.put(voxel.evidence);
    if (robots) stream.put(voxel.robots);
    stream.end_element();
  }
  return report;
}

void write_mesh(const VoxelMesh& mesh, double resolution_m, AtomicFile& file) {
  PlyStream stream(file);
  stream.text(fmt::format("{}element face {}\nproperty list uchar int vertex_indices\nend_header\n",
                          header_start(mesh.corners.size()), mesh.quads.size()));
  const auto coordinate = [&](std::size_t axis, std::int32_t step) {
    return static_cast<float>(mesh.origin_m[axis] + resolution_m * static_cast<double>(step));
  };
  for (const MeshCorner& corner : mesh.corners) {
    stream.put(coordinate(0, corner.at.x));
    stream.put(coordinate(1, corner.at.y));
    stream.put(coordinate(2, corner.at.z));
    put_color(stream, corner.color);
    stream.end_element();
  }
  for (const auto& quad : mesh.quads) {
    stream.put(std::uint8_t{4});
    for (const std::uint32_t index : quad) stream.put(index);
    stream.end_element();
  }
}

}  // namespace

Outcome<WriteReport> write_ply(std::span<const PlyVoxel> voxels, float resolution_m,
                               const std::string& path, PlyForm form,
                               std::span<const std::string> label_names) {
  if (!std::isfinite(resolution_m) || resolution_m <= 0.0F) {
    return Failure{
        fmt::format("cannot export voxels of {} m; the resolution must be positive", resolution_m)};
  }
  TESSERA_TRY_ASSIGN(AtomicFile file, AtomicFile::open(path));
  WriteReport report;
  if (form == PlyForm::kPoints) {
    report = write_points(voxels, file, label_names);
  } else {
    // A voxel has at most eight corners of its own, and the numbers of corners are signed 32-bit
    // integers.
    if (voxels.size() > static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max()) / 8) {
      return Failure{fmt::format(
          "cannot write {}: {} voxels are too many for a PLY mesh; export points or a smaller map",
          path, voxels.size())};
    }
    const VoxelMesh mesh = make_voxel_mesh(voxels, resolution_m);
    write_mesh(mesh, static_cast<double>(resolution_m), file);
    report = {mesh.voxels, mesh.left_out};
  }
  TESSERA_TRY(file.commit());
  return report;
}

}  // namespace tessera
