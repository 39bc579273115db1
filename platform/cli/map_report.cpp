// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/map_report.hpp"

#include <algorithm>
#include <cstdio>

#include "base/number_text.hpp"
#include "cli/command.hpp"
#include "cli/losses.hpp"

namespace tessera {

namespace {

/// Sums of the scans' counters.
struct Totals {
  std::uint64_t points = 0, in_range = 0, integrated = 0, non_finite = 0, too_near = 0,
                beyond_range = 0, out_of_grid = 0, unlabelled = 0;
  std::uint64_t unknown_ids = 0, bad_poses = 0, over_capacity = 0, refused_memory = 0,
                refused_work = 0, rays_refused_memory = 0, rays_refused_work = 0,
                left_out_deadline = 0;
  std::uint64_t left_out = 0, voxel_updates = 0, evaluations = 0, ray_steps = 0;
  std::uint64_t overruns = 0;
  std::int64_t worst_overshoot_us = 0;

  /// What a larger --memory would admit.
  [[nodiscard]] std::uint64_t for_memory() const {
    return refused_memory + over_capacity + rays_refused_memory;
  }
  /// What a larger --work-budget would admit.
  [[nodiscard]] std::uint64_t for_work() const { return refused_work + rays_refused_work; }
};

Totals sum(const std::vector<ScanRecord>& scans) {
  Totals t;
  for (const ScanRecord& scan : scans) {
    const ScanReport& r = scan.report;
    t.points += r.points;
    t.in_range += r.in_range;
    t.integrated += r.admitted - r.points_cut;
    t.non_finite += r.non_finite;
    t.too_near += r.too_near;
    t.beyond_range += r.beyond_range;
    t.out_of_grid += r.out_of_grid;
    t.unlabelled += r.unlabelled;
    t.unknown_ids += scan.unknown.points;
    t.bad_poses += r.pose == Status::kOk ? 0U : 1U;
    t.over_capacity += r.over_capacity;
    t.refused_memory += r.refused_memory();
    t.refused_work += r.refused_work;
    t.rays_refused_memory += r.rays_refused_memory;
    t.rays_refused_work += r.rays_refused_work;
    t.left_out_deadline += r.left_out_deadline();
    t.overruns += r.overshoot_us > 0 ? 1U : 0U;
    t.worst_overshoot_us = std::max(t.worst_overshoot_us, r.overshoot_us);
    t.left_out += r.left_out();
    t.voxel_updates += r.voxel_updates;
    t.evaluations += r.evaluations;
    t.ray_steps += r.ray_steps;
  }
  return t;
}

RegistrarReport registration_of(const std::vector<ScanRecord>& scans) {
  RegistrarReport totals;
  for (const ScanRecord& scan : scans) totals.add(scan.registration);
  return totals;
}

double ms_of(std::int64_t us) { return static_cast<double>(us) / 1000.0; }

Json scan_json(const ScanRecord& scan) {
  const ScanReport& r = scan.report;
  Json json = {
      {"index", scan.index},
      {"points", r.points},
      {"voxel_updates", r.voxel_updates},
      {"milliseconds", scan.milliseconds},
      {"left_out", r.left_out()},
      {"pose", r.pose == Status::kOk ? "ok" : "refused"},
      {"thinned", r.thinned},
      {"admitted", r.admitted},
      {"non_finite", r.non_finite},
      {"too_near", r.too_near},
      {"beyond_range", r.beyond_range},
      {"out_of_grid", r.out_of_grid},
      {"in_range", r.in_range},
      {"unlabelled", r.unlabelled},
      {"unknown_ids", scan.unknown.points},
      {"refused_memory", r.refused_memory()},
      {"refused_storage", r.refused_storage},
      {"refused_tiles", r.refused_tiles},
      {"refused_ray_blocks", r.refused_ray_blocks},
      {"refused_work", r.refused_work},
      {"over_capacity", r.over_capacity},
      {"write_faults", r.write_faults},
      {"rays", r.rays},
      {"rays_refused", r.rays_refused_memory + r.rays_refused_work + r.rays_refused_deadline},
      {"rays_refused_memory", r.rays_refused_memory},
      {"rays_refused_work", r.rays_refused_work},
      {"left_out_deadline", r.left_out_deadline()},
      {"refused_deadline", r.refused_deadline},
      {"rays_refused_deadline", r.rays_refused_deadline},
      {"returns_cut", r.returns_cut},
      {"rays_cut", r.rays_cut},
      {"tiles_cut", r.tiles_cut},
      {"points_cut", r.points_cut},
      {"ray_blocks_cut", r.ray_blocks_cut},
      {"overshoot_ms", ms_of(r.overshoot_us)},
      {"work_limit", r.work_limit},
      {"work_predicted", r.work_predicted},
      {"work_spent", r.work_spent()},
      {"ray_steps", r.ray_steps},
      {"tiles", r.tiles},
      {"ray_blocks", r.ray_blocks},
      {"kernel_evaluations", r.evaluations}};
  write_registration(scan.registration, json);
  return json;
}

Json prior_map_json(const PriorMapReport& prior_map) {
  return {{"resolution", prior_map.resolution_m},
          {"occupied_voxels", prior_map.occupied},
          {"free_voxels", prior_map.free},
          {"free_passes", prior_map.passes},
          {"refused_voxels", prior_map.refused}};
}

void warn_of_losses(const std::vector<ScanRecord>& scans) {
  const Totals t = sum(scans);
  const auto warn_if = [](std::uint64_t count, const char* thing, const std::string& fate) {
    if (count > 0) warn(counted(count, thing) + " " + fate);
  };
  NumberList bad_poses;
  UnknownIdCount unknown;
  for (const ScanRecord& scan : scans) {
    if (scan.report.pose != Status::kOk) bad_poses.add(scan.index);
    unknown.add(scan.index, scan.unknown);
  }
  warn_if(
      t.bad_poses, "scan",
      "left out, with a pose that is not a rigid transform within the grid: " + bad_poses.text());
  warn_if(t.non_finite, "point", "refused: coordinates that are not finite");
  warn_if(t.too_near, "point", "refused: nearer to the sensor than --min-range");
  warn_if(t.out_of_grid, "point", "refused: outside the grid");
  if (unknown.points() > 0) warn(unknown.text());
  warn_if(t.for_memory(), "refusal",
          "of points or rays for lack of memory; give a larger --memory or a coarser --resolution");
  warn_if(t.for_work(), "refusal",
          "of points or rays, as the work budget was spent; give a larger --work-budget");
  warn_if(t.left_out_deadline, "refusal",
          "of points or rays, as the time was up; give a longer --deadline or a coarser "
          "--resolution");
}

/// Warns if no return was mapped, with the main reason.
void warn_of_nothing(const std::vector<ScanRecord>& scans) {
  const Totals t = sum(scans);
  if (t.integrated > 0) return;
  if (t.points == 0) return warn("nothing was mapped: the scans have no points; check the input");
  const std::string all = counted(t.points, "point");
  if (t.beyond_range == t.points)
    return warn("no point was mapped: all " + all +
                " are beyond --max-range; give a larger one, or points in metres");
  warn("no point was mapped: of " + all + " " + std::to_string(t.beyond_range) +
       " are beyond --max-range and " + std::to_string(t.in_range) +
       " within it; the report says why each was left out");
}

}  // namespace

Timing timing_of(const std::vector<ScanRecord>& scans) {
  if (scans.empty()) return {};
  std::vector<double> ms;
  for (const ScanRecord& scan : scans) ms.push_back(scan.milliseconds);
  std::sort(ms.begin(), ms.end());
  const auto rank = [&](double share) {
    const auto i = static_cast<std::size_t>(share * static_cast<double>(ms.size()));
    return ms[std::min(i, ms.size() - 1)];
  };
  const double median =
      ms.size() % 2 == 1 ? ms[ms.size() / 2] : 0.5 * (ms[ms.size() / 2 - 1] + ms[ms.size() / 2]);
  return {median, rank(0.99), ms.back()};
}

Json to_json(const MapRun& run, const Json& config) {
  Json json;
  json["interrupted"] = run.interrupted;
  json["scans"] = Json::array();
  for (const ScanRecord& scan : run.scans) json["scans"].push_back(scan_json(scan));
  const Timing timing = timing_of(run.scans);
  const Totals t = sum(run.scans);
  json["totals"] = {{"median_ms", timing.median_ms},
                    {"p99_ms", timing.p99_ms},
                    {"max_ms", timing.max_ms},
                    {"scans", run.scans.size()},
                    {"points", t.points},
                    {"voxel_updates", t.voxel_updates},
                    {"kernel_evaluations", t.evaluations},
                    {"ray_steps", t.ray_steps},
                    {"left_out", t.left_out},
                    {"left_out_deadline", t.left_out_deadline},
                    {"deadline_overruns", t.overruns},
                    {"worst_overshoot_ms", ms_of(t.worst_overshoot_us)},
                    {"non_finite", t.non_finite},
                    {"too_near", t.too_near},
                    {"beyond_range", t.beyond_range},
                    {"out_of_grid", t.out_of_grid},
                    {"unlabelled", t.unlabelled},
                    {"unknown_ids", t.unknown_ids},
                    {"bad_poses", t.bad_poses}};
  write_registration(registration_of(run.scans), json["totals"]);
  const MapUsage& usage = run.usage;
  json["memory"] = {{"budget_bytes", run.budget_bytes},
                    {"used_bytes", usage.used_bytes},
                    {"peak_bytes", usage.peak_bytes},
                    {"scratch_bytes", run.scratch_bytes},
                    {"label_voxels", usage.label_voxels},
                    {"free_voxels", run.free_voxels},
                    {"bytes_per_label_voxel", usage.label_voxels == 0
                                                  ? 0.0
                                                  : static_cast<double>(usage.used_bytes) /
                                                        static_cast<double>(usage.label_voxels)},
                    {"refused", t.refused_memory + t.over_capacity + t.rays_refused_memory},
                    {"blocks", usage.blocks},
                    {"blocks_refused", usage.blocks_refused},
                    {"storage_refused", usage.storage_refused}};
  if (run.window) json["window"] = to_json(*run.window);
  if (run.prior_map) json["prior_map"] = prior_map_json(*run.prior_map);
  json["heap_allocations_after_init"] = run.heap_allocations ? Json(*run.heap_allocations) : Json();
  json["config"] = config;
  json["digest"] = hex64(run.digest);
  return json;
}

void print_summary(const MapRun& run, const std::string& out) {
  warn_of_losses(run.scans);
  warn_of_nothing(run.scans);
  if (run.prior_map && run.prior_map->refused > 0) {
    warn(counted(run.prior_map->refused, "voxel") +
         " of --prior-map refused for lack of memory; give a larger --memory");
  }
  const MapUsage& usage = run.usage;
  const Timing timing = timing_of(run.scans);
  const Totals t = sum(run.scans);
  std::printf("%s, %s into %s: of %s, %llu in range\n", counted(run.scans.size(), "scan").c_str(),
              counted(t.integrated, "thinned point").c_str(), out.c_str(),
              counted(t.points, "return").c_str(), static_cast<unsigned long long>(t.in_range));
  std::printf("  time     median %.1f ms a scan, p99 %.1f ms, max %.1f ms\n", timing.median_ms,
              timing.p99_ms, timing.max_ms);
  print_registration(registration_of(run.scans));
  std::printf("  voxels   %llu labelled or occupied, %llu free%s\n",
              static_cast<unsigned long long>(usage.label_voxels),
              static_cast<unsigned long long>(run.free_voxels),
              run.window ? ", in memory after the last scan" : "");
  std::printf(
      "  memory   %.1f MB used of %.1f MB, %.1f MB of it scratch, %.1f bytes a label voxel\n",
      static_cast<double>(usage.used_bytes + run.scratch_bytes) / 1e6,
      static_cast<double>(run.budget_bytes) / 1e6, static_cast<double>(run.scratch_bytes) / 1e6,
      usage.label_voxels == 0
          ? 0.0
          : static_cast<double>(usage.used_bytes) / static_cast<double>(usage.label_voxels));
  if (run.window && run.window->archived_blocks > 0) {
    std::printf("  archive  %llu blocks left memory, %llu came back; %.1f MB on disk\n",
                static_cast<unsigned long long>(run.window->evicted),
                static_cast<unsigned long long>(run.window->reloaded),
                static_cast<double>(run.window->archive_bytes) / 1e6);
  }
  if (run.heap_allocations) {
    std::printf("  heap     %llu allocations after start\n",
                static_cast<unsigned long long>(*run.heap_allocations));
  }
  std::printf("  digest   %s\n", hex64(run.digest).c_str());
}

}  // namespace tessera
