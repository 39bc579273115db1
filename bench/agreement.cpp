// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Do compact counts say the same as dense ones? The part of the labelled voxels with the same
// label, the same with free space, and what the rest holds.
#include <cmath>

#include "scenes.hpp"

namespace tessera::bench {

namespace {

Outcome<Json> compare(const Mode& compact_mode, const Scene& scene, const Options& options) {
  Mode dense_mode = compact_mode;
  dense_mode.tuple = TuplePolicy::kDense;
  dense_mode.storage_bytes = std::size_t{3} << 30U;
  Outcome<Mapper> dense = Mapper::make(dense_mode, scene, options.resolution_m);
  Outcome<Mapper> compact = Mapper::make(compact_mode, scene, options.resolution_m);
  if (!dense.ok()) return dense.failure();
  if (!compact.ok()) return compact.failure();
  for (Mapper* const mapper : {&*dense, &*compact}) {
    TESSERA_TRY(mapper->integrate_all(scene));
  }
  std::uint64_t labelled = 0;
  std::uint64_t same_label = 0;
  std::uint64_t same_state = 0;
  double evidence = 0.0;
  double rest = 0.0;
  const std::vector<VoxelCoord> voxels = observed_voxels(*dense);
  for (const VoxelCoord& voxel : voxels) {
    const Estimate exact = dense->map().query(voxel);
    const VoxelEvidence counts = compact->map().evidence(voxel);
    const Estimate small = estimate(counts, compact->map().config().prior);
    same_state += exact.state == small.state ? 1U : 0U;
    evidence += counts.total() - static_cast<double>(counts.sigma[0]);
    rest += static_cast<double>(counts.rest);
    if (exact.label == 0) continue;
    ++labelled;
    same_label += exact.label == small.label ? 1U : 0U;
  }
  const auto part = [](double some, double all) { return all > 0.0 ? some / all : 0.0; };
  return Json{
      {"title", compact_mode.title},
      {"voxels", voxels.size()},
      {"labelled", labelled},
      {"same_label", part(static_cast<double>(same_label), static_cast<double>(labelled))},
      {"same_state", part(static_cast<double>(same_state), static_cast<double>(voxels.size()))},
      {"evidence_in_rest", part(rest, evidence)}};
}

Outcome<Json> measure(const Options& options, Records&) {
  TESSERA_TRY_ASSIGN(const Scene scene, load_scene(options));
  Mode kernel = kKernelMode;
  kernel.tuple = TuplePolicy::kCompact;
  kernel.storage_bytes = std::size_t{512} << 20U;
  Json modes = Json::object();
  for (const Mode& mode : {kernel, kMultiEntropyMode, kFreeSpaceMode, kCountingMode}) {
    TESSERA_TRY_ASSIGN(Json compared, compare(mode, scene, options));
    modes[mode.name] = std::move(compared);
  }
  return Json{{"modes", modes}};
}

}  // namespace

}  // namespace tessera::bench

int main(int argc, char** argv) {
  return tessera::bench::run(argc, argv, "agreement", tessera::bench::measure);
}
