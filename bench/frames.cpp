// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What does bringing a map into another frame cost? A map of a sequence with true labels is the
// only contribution of a global map, without diffusion, in frames that are turned, tilted and
// shifted; each is judged over the map in its own frame, on the points of the same scans. With
// --ways, other ways to do that beside the library's.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <unordered_map>
#include <unordered_set>

#include "maps/scores.hpp"
#include "refinement.hpp"
#include "resampling.hpp"
#include "teams.hpp"
#include "tessera/base/rigid.hpp"

namespace tessera::bench {

namespace {

struct FrameOptions {
  std::string dataset;
  int first = 0;
  int last = 5;
  double resolution_m = 0.1;
  double max_range_m = 0.0;
  bool ways = false;
  bool refinement = false;
};

using Voxels = std::unordered_set<std::uint64_t>;

/// What a map has in a voxel of the grid in which it is judged.
using Ask = std::function<VoxelEvidence(const VoxelCoord&)>;

/// What one way has lost, over all frames.
struct Losses {
  std::vector<double> miou;
  double least_covered = 100.0;
  double most_walls = 0.0;
};

class Judge {
 public:
  static Outcome<Judge> make(const FrameOptions& options) {
    Judge judge;
    judge.resolution_m_ = options.resolution_m;
    judge.max_range_m_ = options.max_range_m;
    const auto load = [&](const char* labels) {
      return load_scene(options.dataset,
                        {.first = options.first, .last = options.last, .labels = labels});
    };
    TESSERA_TRY_ASSIGN(judge.scene_, load("predictions"));
    TESSERA_TRY_ASSIGN(judge.truth_, load("labels"));
    Mode mode = kFreeSpaceMode;
    mode.max_range_m = static_cast<float>(options.max_range_m);
    mode.storage_bytes = std::size_t{2} << 30U;
    TESSERA_TRY_ASSIGN(judge.mapper_, Mapper::make(mode, judge.scene_, options.resolution_m));
    TESSERA_TRY(judge.mapper_.integrate_all(judge.scene_));
    judge.contribution_ = contribution_of(judge.mapper_);
    judge.config_ = config_for(judge.mapper_.map().config(), std::span(&judge.contribution_, 1));
    judge.config_.diffusion.mode = DiffusionMode::kNone;
    if (options.ways) {
      judge.means_ = std::make_unique<MeansOfReturns>(judge.scene_, options.resolution_m);
      judge.ways_ = ways_to_resample(*judge.means_);
    }
    const Matrix34d T = Matrix34d::Identity();
    const auto own = [&](const VoxelCoord& voxel) { return judge.mapper_.map().evidence(voxel); };
    judge.own_ = judge.scores(own, T);
    judge.note_free();
    judge.print_own();
    return judge;
  }

  void print_own() const {
    std::printf("%zu scans, %llu points: mIoU %.2f, coverage %.2f %%, %zu free voxels\n",
                scene_.scans.size(), static_cast<unsigned long long>(own_.points()),
                100.0 * miou(own_), 100.0 * own_.coverage(), free_.size());
  }

  Outcome<void> judge(const Frame& frame) {
    const Matrix34d T = transform_of(frame, resolution_m_);
    TESSERA_TRY_ASSIGN(OwnedGlobalMap global, fused(T));
    print_row(frame, "the library", T,
              [&](const VoxelCoord& voxel) { return global->map().evidence(voxel); });
    const NewGrid grid(T, resolution_m_);
    for (const Way& way : ways_)
      print_row(frame, way.name.c_str(), T,
                [&](const VoxelCoord& voxel) { return way.evidence(mapper_.map(), grid, voxel); });
    return {};
  }

  void print_all() const {
    std::printf(
        "\n| all frames | mIoU: worst | mean | coverage: worst, %% | free voxels occupied: "
        "most, %% |\n|---|---|---|---|---|\n");
    for (const auto& [name, losses] : losses_) {
      double sum = 0.0;
      for (const double lost : losses.miou) sum += lost;
      std::printf("| %s | %+.2f | %+.2f | %+.2f | %.3f |\n", name.c_str(),
                  *std::min_element(losses.miou.begin(), losses.miou.end()),
                  sum / static_cast<double>(losses.miou.size()), losses.least_covered,
                  losses.most_walls);
    }
  }

 private:
  [[nodiscard]] double prior() const { return mapper_.map().config().prior; }
  [[nodiscard]] double miou(const Scores& scores) const {
    return scores.map().mean_iou(scene_.classes.num_classes());
  }

  void print_row(const Frame& frame, const char* name, const Matrix34d& T, const Ask& ask) {
    const Scores there = scores(ask, T);
    const double lost = 100.0 * (miou(there) - miou(own_));
    const double covered = 100.0 * (there.coverage() - own_.coverage());
    const double walls = 100.0 * occupied_part(ask, T);
    int worst_class = 1;
    double worst = 100.0;
    for (int label = 1; label <= scene_.classes.num_classes(); ++label) {
      const double change = 100.0 * (there.map().iou(label) - own_.map().iou(label));
      if (!own_.map().present(label) || change >= worst) continue;
      worst = change;
      worst_class = label;
    }
    const std::string of(scene_.classes[worst_class].name_view());
    std::printf("| %g | %g | %g | %s | %+.2f | %+.2f | %.3f | %s %+.2f |\n", frame.yaw_deg,
                frame.tilt_deg, frame.shift_voxels, name, lost, covered, walls, of.c_str(), worst);
    Losses& losses = losses_[name];
    losses.miou.push_back(lost);
    losses.least_covered = std::min(losses.least_covered, covered);
    losses.most_walls = std::max(losses.most_walls, walls);
  }

  /// The points of the scans, brought into the frame. Each voxel is asked for once.
  [[nodiscard]] Scores scores(const Ask& ask, const Matrix34d& T) const {
    const Lattice lattice(resolution_m_);
    const double most = max_range_m_ > 0.0 ? max_range_m_ * max_range_m_ : 1e18;
    std::unordered_map<std::uint64_t, VoxelEvidence> known;
    Scores scores;
    for (std::size_t s = 0; s < scene_.scans.size(); ++s) {
      const Scan& scan = scene_.scans[s];
      const std::vector<std::uint8_t>& truth = truth_.scans[s].components;
      const Matrix34d T_frame_sensor = product(T, scan.T_map_sensor);
      for (std::size_t i = 0; i < truth.size(); ++i) {
        const float* const p = scan.points_xyzi.data() + 4 * i;
        const double square = static_cast<double>(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
        const Result<VoxelCoord> voxel = lattice.voxel_of(transform(T_frame_sensor, p));
        if (truth[i] >= scene_.classes.unlabelled() || truth[i] == 0 || square > most ||
            !voxel.ok())
          continue;
        const auto [at, is_new] = known.try_emplace(key_of(*voxel));
        if (is_new) at->second = ask(*voxel);
        scores.add(truth[i], at->second, mapper_.map().reading(), scan.components[i]);
      }
    }
    return scores;
  }

  /// Voxels that returns are in, of whatever range and label.
  [[nodiscard]] Voxels met(const Matrix34d& T) const {
    const Lattice lattice(resolution_m_);
    Voxels found;
    for (const Scan& scan : scene_.scans) {
      const Matrix34d T_frame_sensor = product(T, scan.T_map_sensor);
      for (std::size_t i = 0; i < scan.components.size(); ++i) {
        const Point3f p = transform(T_frame_sensor, scan.points_xyzi.data() + 4 * i);
        if (const Result<VoxelCoord> voxel = lattice.voxel_of(p); voxel.ok())
          found.insert(key_of(*voxel));
      }
    }
    return found;
  }

  void note_free() {
    const Voxels found = met(Matrix34d::Identity());
    for (const VoxelCoord& voxel : observed_voxels(mapper_)) {
      if (mapper_.map().query(voxel).state != VoxelState::kFree || found.count(key_of(voxel)) != 0)
        continue;
      free_.push_back(voxel);
      is_free_.insert(key_of(voxel));
    }
  }

  /// Of the new grid's voxels whose centre is in a free voxel, and that no return is in. Of many
  /// free voxels every so many are looked at.
  [[nodiscard]] double occupied_part(const Ask& ask, const Matrix34d& T) const {
    const Lattice lattice(resolution_m_);
    const Matrix34d back = inverse(T);
    const Voxels found = met(T);
    Voxels seen;
    std::size_t occupied = 0;
    std::size_t all = 0;
    constexpr std::size_t kMost = 1'000'000;
    const std::size_t step = 1 + free_.size() / kMost;
    for (std::size_t i = 0; i < free_.size(); i += step) {
      const VoxelCoord& voxel = free_[i];
      const VoxelCoord there = *lattice.voxel_of(apply(T, lattice.center_of(voxel)));
      const VoxelCoord taken = *lattice.voxel_of(apply(back, lattice.center_of(there)));
      if (is_free_.count(key_of(taken)) == 0 || found.count(key_of(there)) != 0 ||
          !seen.insert(key_of(there)).second)
        continue;
      ++all;
      occupied += estimate(ask(there), prior()).state == VoxelState::kOccupied ? 1U : 0U;
    }
    return static_cast<double>(occupied) / static_cast<double>(std::max<std::size_t>(all, 1));
  }

  [[nodiscard]] Outcome<OwnedGlobalMap> fused(const Matrix34d& T) const {
    TESSERA_TRY_ASSIGN(OwnedGlobalMap global, OwnedGlobalMap::make(config_, scene_.classes));
    const Result<GridTransform> frame = GridTransform::make(T, resolution_m_);
    const Result<GlobalMap::Slot> slot = global->open({0, 0, 0}, *frame);
    bool taken = slot.ok();
    for (const PublishedBlock& block : contribution_.blocks)
      taken = taken && global->put(*slot, block.key, 1, block.bytes).ok();
    while (taken && global->busy()) static_cast<void>(global->step(~std::uint64_t{0}));
    const GlobalMapReport report = global->report();
    if (!taken || report.refused_blocks + report.refused_sums + report.refused_outputs > 0)
      return Failure{"the global map has no room for the map", FailureKind::kFailure};
    return global;
  }

  double resolution_m_ = 0.1;
  double max_range_m_ = 0.0;
  Scene scene_;
  Scene truth_;  ///< The same with true labels.
  Mapper mapper_;
  std::unique_ptr<MeansOfReturns> means_;
  std::vector<Way> ways_;
  Contribution contribution_;
  GlobalMapConfig config_;
  Scores own_;  ///< In its own frame.
  std::vector<VoxelCoord> free_;
  Voxels is_free_;
  std::map<std::string, Losses> losses_;
};

Outcome<void> answer(const FrameOptions& options) {
  TESSERA_TRY_ASSIGN(Judge judge, Judge::make(options));
  std::printf(
      "| yaw, degrees | tilt, degrees | shift, voxels | way | mIoU | coverage, %% | free voxels "
      "occupied, %% | worst class |\n|---|---|---|---|---|---|---|---|\n");
  for (const Frame& frame : frames()) TESSERA_TRY(judge.judge(frame));
  judge.print_all();
  return {};
}

}  // namespace

}  // namespace tessera::bench

int main(int argc, char** argv) {
  CLI::App app{"What bringing a map into another frame costs, by true labels"};
  tessera::bench::FrameOptions options;
  app.add_option("--dataset", options.dataset,
                 "Sequence in the KITTI layout with labels and predictions")
      ->required();
  app.add_option("--first", options.first);
  app.add_option("--last", options.last);
  app.add_option("--resolution", options.resolution_m);
  app.add_option("--max-range", options.max_range_m, "Metres; 0: no limit");
  app.add_flag("--ways", options.ways, "Other ways to resample, too");
  app.add_flag("--refinement", options.refinement,
               "Instead: what finding the frame between both halves of the scans costs, and "
               "finding it anew when some blocks have changed");
  CLI11_PARSE(app, argc, argv);
  const tessera::Outcome<void> done =
      options.refinement
          ? tessera::bench::measure_refinement({options.dataset, options.first, options.last,
                                                options.resolution_m, options.max_range_m})
          : tessera::bench::answer(options);
  if (done.ok()) return 0;
  std::fprintf(stderr, "%s\n", done.failure().text().c_str());
  return 1;
}
