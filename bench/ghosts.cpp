// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Ghosts and holes in the map of a sequence with true labels: of the points on moving things
// through which a later scan looks, how many are not occupied any more (DA), after the last scan or
// within some scans; of all other labelled points, how many still are (SA). And what a scan costs
// with either way of carving. Also before a sensor that stands, where nothing moves.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <map>

#include "ghost_truth.hpp"
#include "standing_sensor.hpp"

namespace tessera::bench {

namespace {

struct Count {
  std::size_t occupied = 0;
  std::size_t all = 0;
  void add(bool is_occupied) {
    ++all;
    occupied += is_occupied ? 1 : 0;
  }
  [[nodiscard]] double part() const {
    return all == 0 ? 0.0 : 100.0 * static_cast<double>(occupied) / static_cast<double>(all);
  }
};

/// Why points on moving things stay: the first of these that is true.
struct Reasons {
  std::size_t met_again = 0;  ///< The voxel, when it was seen through first or later.
  std::size_t met_beside = 0;
  std::size_t seen_once = 0;
  std::size_t others = 0;
  std::size_t label_moves = 0;  ///< Of all of them: the point's label may move.
  std::size_t twice = 0;        ///< Of all of them: seen through by two scans or more.
  std::size_t twice_met = 0;    ///< Of these: the voxel was met again.
};

void print_holes(const std::map<std::uint32_t, Count>& by_id) {
  std::printf("    lost:");
  for (const auto& [id, count] : by_id)
    if (count.occupied != count.all)
      std::printf(" %u: %zu of %zu", id, count.all - count.occupied, count.all);
  std::printf("\n");
}

void print_ghosts(const std::map<std::uint32_t, Count>& by_id,
                  const std::map<std::uint32_t, Reasons>& reasons) {
  for (const auto& [id, why] : reasons) {
    const Count& count = by_id.at(id);
    std::printf(
        "    still there, %u: %zu of %zu (voxel met again %zu, else one beside it %zu, else seen "
        "through once %zu, others %zu); %zu of them with a label that may move; %zu seen through "
        "twice, of these %zu met again\n",
        id, count.occupied, count.all, why.met_again, why.met_beside, why.seen_once, why.others,
        why.label_moves, why.twice, why.twice_met);
  }
}

class Judge {
 public:
  Judge(const Scene& scene, const Truth& truth, double resolution_m)
      : scene_(scene), truth_(truth), lattice_(resolution_m), resolution_m_(resolution_m) {
    for (const Judged& point : truth.moving) due_[point.judged_after].push_back(&point);
  }

  Outcome<void> print_row(const char* name, Carving carving) {
    Mode mode = kFreeSpaceMode;
    mode.max_range_m = static_cast<float>(kGhostRange_m);
    mode.carving = carving;
    mode.storage_bytes = std::size_t{2} << 30U;
    TESSERA_TRY_ASSIGN(Mapper mapper, Mapper::make(mode, scene_, resolution_m_));
    // Before it is timed, so that memory is touched.
    TESSERA_TRY(mapper.integrate_all(scene_));
    mapper.map().clear();
    Times times;
    Count moving;
    Count not_met;
    Count twice;
    Count standing;
    std::map<std::uint32_t, Count> ghosts;
    std::map<std::uint32_t, Reasons> reasons;
    std::map<std::uint32_t, Count> holes;
    for (std::size_t s = 0; s < scene_.scans.size(); ++s) {
      ScanReport report;
      times.measure([&] { report = mapper.integrate(scene_.scans[s]); });
      if (report.pose != Status::kOk || report.left_out() > 0)
        return Failure{"a scan did not fit as a whole", FailureKind::kFailure};
      for (const Judged* point : due_[s]) {
        const bool occupied = is_occupied(mapper, *point);
        moving.add(occupied);
        ghosts[point->id].add(occupied);
        if (point->seen_through >= 2) twice.add(occupied);
        if (!met_again(*point)) not_met.add(occupied);
        if (occupied) add_reason(*point, reasons[point->id]);
      }
    }
    for (const Judged& point : truth_.standing) {
      const bool occupied = is_occupied(mapper, point);
      standing.add(occupied);
      holes[point.id].add(occupied);
    }
    const double cleared = 100.0 - moving.part();
    const double kept = standing.part();
    if (moving.all == 0) {
      std::printf("| %s | | | | %.2f | | %.1f |\n", name, kept, median(times.cpu_ms));
    } else {
      std::printf("| %s | %.1f | %.1f | %.1f | %.2f | %.1f | %.1f |\n", name, cleared,
                  100.0 - twice.part(), 100.0 - not_met.part(), kept,
                  cleared + kept == 0.0 ? 0.0 : 2.0 * cleared * kept / (cleared + kept),
                  median(times.cpu_ms));
    }
    print_ghosts(ghosts, reasons);
    print_holes(holes);
    return {};
  }

 private:
  [[nodiscard]] static bool is_occupied(Mapper& mapper, const Judged& point) {
    return mapper.map().query(point.p_map).state == VoxelState::kOccupied;
  }
  [[nodiscard]] VoxelCoord voxel_of(const Judged& point) const {
    return *lattice_.voxel_of(point.p_map.cast<double>());
  }
  [[nodiscard]] bool met_again(const Judged& point) const {
    return truth_.met(voxel_of(point), point.first_seen, point.judged_after);
  }
  void add_reason(const Judged& point, Reasons& reasons) const {
    const int last = point.judged_after;
    reasons.label_moves += point.label_may_move ? 1 : 0;
    if (point.seen_through >= 2) {
      ++reasons.twice;
      if (met_again(point)) ++reasons.twice_met;
    }
    if (met_again(point)) {
      ++reasons.met_again;
    } else if (truth_.met_beside(voxel_of(point), point.first_seen, last)) {
      ++reasons.met_beside;
    } else if (point.seen_through < 2) {
      ++reasons.seen_once;
    } else {
      ++reasons.others;
    }
  }

  const Scene& scene_;
  const Truth& truth_;
  Lattice lattice_;
  double resolution_m_;
  std::map<std::size_t, std::vector<const Judged*>> due_;
};

Outcome<void> compare(const Scene& scene, const TrueIds& ids, double resolution_m, int within) {
  const Truth truth = truth_of(scene, ids, Lattice(resolution_m), within);
  const auto twice = std::count_if(truth.moving.begin(), truth.moving.end(),
                                   [](const Judged& point) { return point.seen_through >= 2; });
  std::printf(
      "%zu scans; %zu points on moving things seen through, %td by two scans or more, %zu left out "
      "for others in their voxel, %zu seen through too late; %zu others\n",
      scene.scans.size(), truth.moving.size(), twice, truth.left_out, truth.too_late,
      truth.standing.size());
  std::printf(
      "| carving | cleared, %% | seen through twice, %% | voxel not met again, %% | kept, %% | "
      "harmonic mean, %% | ms a scan, CPU |\n|---|---|---|---|---|---|---|\n");
  Judge judge(scene, truth, resolution_m);
  for (const Carving carving : {Carving::kRays, Carving::kImage})
    TESSERA_TRY(judge.print_row(to_string(carving), carving));
  return {};
}

struct GhostOptions {
  std::string dataset;
  std::string labels = "predictions";
  int first = 0;
  int last = 5;
  int within = 0;
  double resolution_m = 0.1;
  bool standing = false;
  StandingOptions sensor;
};

Outcome<void> answer(const GhostOptions& options) {
  if (options.standing) {
    std::printf("standing sensor, seed %llu; fences with bars every %.2f m; labels: %s\n",
                static_cast<unsigned long long>(options.sensor.seed), options.sensor.period_m,
                options.sensor.true_labels ? "true" : "predictions");
    const StandingScene standing = standing_scene(options.sensor);
    return compare(standing.scene, standing.ids, options.resolution_m, 0);
  }
  const std::string& dataset = options.dataset;
  TESSERA_TRY_ASSIGN(const Scene scene, load_scene(dataset, {.first = options.first,
                                                             .last = options.last,
                                                             .labels = options.labels}));
  TESSERA_TRY_ASSIGN(const TrueIds ids, read_true_ids(dataset, options.first, scene));
  std::printf("%s; labels: %s; moving things judged ", dataset.c_str(), options.labels.c_str());
  if (options.within == 0) {
    std::printf("after the last scan\n");
  } else {
    std::printf("%d scans after they were seen through first\n", options.within);
  }
  return compare(scene, ids, options.resolution_m, options.within);
}

}  // namespace

}  // namespace tessera::bench

int main(int argc, char** argv) {
  CLI::App app{"Ghosts of what moved, and holes in what stands, by true labels"};
  tessera::bench::GhostOptions options;
  auto* const dataset = app.add_option("--dataset", options.dataset,
                                       "Sequence in the KITTI layout with labels and predictions");
  app.add_option("--labels", options.labels, "Folder of the labels that the mapper gets");
  app.add_option("--first", options.first);
  app.add_option("--last", options.last);
  app.add_option("--within", options.within,
                 "Judge moving things so many scans after the one that saw through them first; 0: "
                 "after the last")
      ->check(CLI::Range(0, 1000));
  app.add_option("--resolution", options.resolution_m);
  auto* const standing = app.add_option("--standing", options.sensor.seed,
                                        "Instead: a standing sensor in the street of this seed");
  app.add_option("--scans", options.sensor.scans, "Of the standing sensor")
      ->check(CLI::Range(1, 1000));
  app.add_option("--period", options.sensor.period_m, "Of the bars of its fences, metres")
      ->check(CLI::Range(0.02, 2.0));
  dataset->excludes(standing);
  CLI11_PARSE(app, argc, argv);
  options.standing = standing->count() > 0;
  options.sensor.true_labels = options.labels == "labels";
  if (!options.standing && dataset->count() == 0) {
    std::fprintf(stderr, "--dataset or --standing is required\n");
    return 1;
  }
  const tessera::Outcome<void> done = tessera::bench::answer(options);
  if (done.ok()) return 0;
  std::fprintf(stderr, "%s\n", done.failure().text().c_str());
  return 1;
}
