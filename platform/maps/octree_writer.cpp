// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "maps/octree_writer.hpp"

#if TESSERA_HAS_OCTOMAP
#include <fmt/core.h>
#include <octomap/OcTree.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <new>
#include <ostream>
#include <streambuf>
#include <vector>

#include "base/atomic_file.hpp"
#include "base/progress.hpp"
#include "settings/map_options.hpp"
#include "tessera/map/queries.hpp"
#endif

namespace tessera {

#if TESSERA_HAS_OCTOMAP

namespace {

constexpr double kLeastOccupancy = 1e-6;
/// A free voxel with log-odds of 0 would be occupied for OctoMap.
constexpr float kFreeAtMost = -1e-6F;

/// Writes the output of a stream to the file.
class FileBuffer final : public std::streambuf {
 public:
  explicit FileBuffer(AtomicFile& file) : file_(file) {}

 protected:
  std::streamsize xsputn(const char* text, std::streamsize count) override {
    const std::span<const char> bytes(text, static_cast<std::size_t>(count));
    return file_.write(std::as_bytes(bytes)) ? count : 0;
  }
  int_type overflow(int_type letter) override {
    if (traits_type::eq_int_type(letter, traits_type::eof())) return traits_type::not_eof(letter);
    const char byte = traits_type::to_char_type(letter);
    return xsputn(&byte, 1) == 1 ? letter : traits_type::eof();
  }

 private:
  AtomicFile& file_;
};

/// Number of digits in the header with which a reader gets the same resolution.
int digits_of(double resolution_m) {
  char text[32] = {};
  for (int digits = 6; digits < 17; ++digits) {
    const auto [end, error] =
        std::to_chars(text, text + sizeof(text), resolution_m, std::chars_format::general, digits);
    double back = 0.0;
    std::from_chars(text, end, back);
    if (error == std::errc{} && back == resolution_m) return digits;
  }
  return 17;
}

octomap::OcTreeKey key_of(VoxelCoord voxel) {
  const auto at = [](std::int32_t v) {
    return static_cast<octomap::key_type>(v + kOctreeVoxelLimit);
  };
  return {at(voxel.x), at(voxel.y), at(voxel.z)};
}

float log_odds_of(const Estimate& estimate, OctreeForm form) {
  const bool occupied = estimate.state == VoxelState::kOccupied;
  if (form == OctreeForm::kBinary) return occupied ? 1.0F : -1.0F;
  const double p = std::clamp(estimate.occupancy, kLeastOccupancy, 1.0 - kLeastOccupancy);
  const auto log_odds = static_cast<float>(std::log(p / (1.0 - p)));
  return occupied ? std::max(log_odds, 0.0F) : std::min(log_odds, kFreeAtMost);
}

Outcome<void> check_extent(const LocalMap& map, std::span<const KeyedIndex> blocks) {
  constexpr std::int32_t kBlocks = kOctreeVoxelLimit / kBlockEdge;
  for (const KeyedIndex& item : blocks) {
    const BlockCoord block = unpack(BlockKey{item.key});
    if (detail::all_within(kBlocks, block.x, block.y, block.z)) continue;
    const double reach_m = map.lattice().resolution_m() * kOctreeVoxelLimit;
    return Failure{
        fmt::format(
            "the map reaches beyond {:.6g} m from its origin, where OctoMap's 16 levels end at "
            "this resolution; export another format, or map at a coarser ",
            reach_m) +
        kMapSettings["--resolution"]};
  }
  return {};
}

/// Prunes eight equal nodes at once, so that free space never needs a node per voxel.
void fill(const LocalMap& map, const OctreeOptions& options, std::span<const KeyedIndex> blocks,
          octomap::OcTree& tree, OctreeReport& report) {
  tree.setClampingThresMin(kLeastOccupancy);
  tree.setClampingThresMax(1.0 - kLeastOccupancy);
  Progress progress("exporting", blocks.size());
  std::uint64_t done = 0;
  for (const KeyedIndex& item : blocks) {
    const auto put = [&](const VoxelCoord& voxel, const VoxelEvidence& evidence) {
      const Estimate e = estimate(evidence, map.config().prior);
      if (e.state == VoxelState::kUnknown || e.evidence < options.min_evidence) return;
      ++(e.state == VoxelState::kOccupied ? report.occupied : report.free);
      tree.setNodeValue(key_of(voxel), log_odds_of(e, options.form), false);
    };
    for_each_observed(map, map.block_at(item.index), put);
    progress.update(++done);
  }
  progress.finish();
  report.nodes = tree.size();
}

/// Writes its own header, as that of OctoMap prints on stderr when it is done.
void write_tree(const octomap::OcTree& tree, OctreeForm form, std::ostream& stream) {
  const bool is_binary = form == OctreeForm::kBinary;
  stream << (is_binary ? "# Octomap OcTree binary file\n" : "# Octomap OcTree file\n")
         << "# voxels of a tessera map, metres, map frame\n#\nid " << tree.getTreeType()
         << "\nsize " << tree.size() << "\nres " << tree.getResolution() << "\ndata\n";
  if (tree.size() == 0) return;
  if (is_binary)
    tree.writeBinaryData(stream);
  else
    tree.writeData(stream);
}

}  // namespace

bool can_write_octrees() noexcept { return true; }

Outcome<OctreeReport> write_octree(const LocalMap& map, const OctreeOptions& options,
                                   const std::string& path) {
  TESSERA_TRY_ASSIGN(AtomicFile file, AtomicFile::open(path));
  std::vector<KeyedIndex> workspace(2 * map.block_count());
  const std::span<const KeyedIndex> blocks = map.blocks_in_order(workspace);
  TESSERA_TRY(check_extent(map, blocks));
  OctreeReport report;
  try {
    octomap::OcTree tree(map.lattice().resolution_m());
    fill(map, options, blocks, tree, report);
    FileBuffer buffer(file);
    std::ostream stream(&buffer);
    stream.precision(digits_of(tree.getResolution()));
    write_tree(tree, options.form, stream);
  } catch (const std::bad_alloc&) {
    return Failure{
        "no memory for the tree of " + path + "; export fewer voxels, with --min-evidence",
        FailureKind::kFailure};
  }
  TESSERA_TRY(file.commit());
  return report;
}

#else

bool can_write_octrees() noexcept { return false; }

Outcome<OctreeReport> write_octree(const LocalMap&, const OctreeOptions&, const std::string&) {
  return Failure{
      "this build has no OctoMap; install liboctomap-dev and build again, or export another "
      "format"};
}

#endif

}  // namespace tessera
