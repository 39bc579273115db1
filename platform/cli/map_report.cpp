// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/map_report.hpp"

#include <algorithm>
#include <cstdio>
#include <string>

#include "base/counters_json.hpp"
#include "base/number_text.hpp"
#include "cli/command.hpp"
#include "cli/losses.hpp"
#include "scans/scan_losses.hpp"

namespace tessera {

namespace {

/// Sums over the scans.
struct Totals : ScanTotals {
  std::uint64_t unknown_ids = 0;
  std::uint64_t bad_poses = 0;
  std::uint64_t of_bad_poses = 0;  ///< Points.
  std::uint64_t no_returns = 0;
  std::uint64_t overruns = 0;
};

Totals sum(const std::vector<ScanRecord>& scans) {
  Totals t;
  for (const ScanRecord& scan : scans) {
    t.add(scan.report);
    t.unknown_ids += scan.unknown.points;
    const bool placed = scan.report.pose == Status::kOk;
    t.bad_poses += placed ? 0U : 1U;
    (placed ? t.no_returns : t.of_bad_poses) += placed ? scan.no_returns : scan.report.points;
    t.overruns += scan.report.overshoot_us > 0 ? 1U : 0U;
  }
  return t;
}

RegistrarReport registration_of(const std::vector<ScanRecord>& scans) {
  RegistrarReport totals;
  for (const ScanRecord& scan : scans) totals.add(scan.registration);
  return totals;
}

Json scan_json(const ScanRecord& scan) {
  const ScanReport& r = scan.report;
  Json json = {{"index", scan.index},
               {"milliseconds", scan.milliseconds},
               {"pose", r.pose == Status::kOk ? "ok" : "refused"},
               {"unknown_ids", scan.unknown.points},
               {"kernel_evaluations", r.evaluations}};
  add_counters(json, r);
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

/// Many drivers write zeros where a beam did not return: nothing is lost then.
std::string no_returns_text(const Totals& t) {
  if (t.no_returns == 0) return {};
  if (t.no_returns >= t.too_near) return ", at 0, 0, 0 (no return)";
  return fmt::format(", {} of them at 0, 0, 0 (no return)", t.no_returns);
}

void warn_of_losses(const std::vector<ScanRecord>& scans) {
  const Totals t = sum(scans);
  const auto warn_if = [](std::uint64_t count, const char* thing, const std::string& fate) {
    if (count > 0) warn(counted(count, thing) + " " + fate);
  };
  const auto warn_of_points = [&t](std::uint64_t count, const std::string& reason) {
    if (count > 0)
      warn(fmt::format("{} of {} refused: {}", count, counted(t.points, "point"), reason));
  };
  NumberList not_rigid;
  NumberList out_of_grid;
  UnknownIdCount unknown;
  for (const ScanRecord& scan : scans) {
    if (scan.report.pose != Status::kOk) (scan.rigid ? out_of_grid : not_rigid).add(scan.index);
    unknown.add(scan.index, scan.unknown);
  }
  warn_if(not_rigid.count(), "scan",
          "left out, with a pose that is not a rigid transform: " + not_rigid.text());
  warn_if(out_of_grid.count(), "scan",
          "left out, with a pose outside the grid: " + out_of_grid.text() +
              "; subtract an origin from the coordinates");
  warn_of_points(t.non_finite, "coordinates that are not finite");
  warn_of_points(t.too_near, "nearer to the sensor than --min-range" + no_returns_text(t));
  warn_of_points(t.out_of_grid, "outside the grid");
  if (unknown.points() > 0) warn(unknown.text());
  warn_if(t.wrong_labels, "point",
          "taken as unlabelled: the weights of its labels sum to over 255");
  warn_if(left_out_for_memory(t), "refusal",
          "of points or rays for lack of memory; give a larger --memory or a coarser --resolution");
  warn_if(left_out_for_work(t), "refusal",
          "of points or rays, as the work budget was spent; give a larger --work-budget");
  warn_if(t.left_out_deadline, "refusal",
          "of points or rays, as the time was up; give a longer --deadline or a coarser "
          "--resolution");
}

/// Warns if no return or next to none was mapped, with the main reason.
void warn_of_nothing(const Totals& t) {
  if (const auto why = why_nothing_mapped(t, t.of_bad_poses))
    warn(text_of(*why, t, t.of_bad_poses));
}

/// Warns if labels were asked for and there are none. Of clouds without a field open_source() does.
void warn_of_no_label(const Totals& t, const std::string& labels) {
  if (labels == kNoLabels || labels == "field") return;
  if (t.in_range == 0 || t.unlabelled < t.in_range) return;
  warn(fmt::format(
      "no label was mapped: all {} in range are unlabelled in {}; check --labels and the "
      "ids of the classes",
      counted(t.in_range, "point"), labels));
}

}  // namespace

std::uint64_t count_no_returns(const Scan& scan) {
  if (scan.kind != ScanKind::kCloud) return 0;
  const PointsView points = scan.points_view();
  std::uint64_t count = 0;
  for (std::size_t i = 0; i < points.count; ++i) {
    const float* const p = points.points + i * points.stride_floats;
    count += p[0] == 0.0F && p[1] == 0.0F && p[2] == 0.0F ? 1U : 0U;
  }
  return count;
}

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

Json calibration_of(const LocalMap& map) {
  const Reading& reading = map.reading();
  const bool effective = reading.is_effective();
  Json json = {
      {"probabilities", to_string(effective ? Probabilities::kEffective : Probabilities::kShares)}};
  if (!effective) return json;
  json["gain"] = Reading::kGain;
  json["correlation"] = Reading::kCorrelation;
  json["prior_weight"] = Reading::kPriorWeight;
  json["around"] = reading.around();
  json["worth"] = Json::object();
  for (int label = 1; label <= map.classes().num_classes(); ++label)
    json["worth"][std::string(map.classes()[label].name_view())] = reading.worth(label);
  return json;
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
                    {"kernel_evaluations", t.evaluations},
                    {"deadline_overruns", t.overruns},
                    {"worst_overshoot_ms", 1e-3 * static_cast<double>(t.overshoot_us)},
                    {"unknown_ids", t.unknown_ids},
                    {"bad_poses", t.bad_poses}};
  add_counters(json["totals"], static_cast<const ScanTotals&>(t));
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
                    {"refused", left_out_for_memory(t)},
                    {"blocks", usage.blocks},
                    {"blocks_refused", usage.blocks_refused},
                    {"storage_refused", usage.storage_refused}};
  if (run.window) json["window"] = to_json(*run.window);
  if (run.prior_map) json["prior_map"] = prior_map_json(*run.prior_map);
  json["contradicted"] = {{"voxels_doubted", t.voxels_doubted},
                          {"voxels_cleared", t.voxels_cleared}};
  json["calibration"] = run.calibration;
  json["heap_allocations_after_init"] = run.heap_allocations ? Json(*run.heap_allocations) : Json();
  json["config"] = config;
  json["file"] = {{"label_voxels", run.file.label_voxels},
                  {"free_voxels", run.file.free_voxels},
                  {"occupied_state", run.file.occupied},
                  {"free_state", run.file.free}};
  json["digest"] = hex64(run.file.digest);
  return json;
}

void print_summary(const MapRun& run, const std::string& out) {
  const Totals t = sum(run.scans);
  warn_of_nothing(t);
  warn_of_no_label(t, run.labels);
  warn_of_losses(run.scans);
  if (run.prior_map && run.prior_map->refused > 0) {
    warn(counted(run.prior_map->refused, "voxel") +
         " of --prior-map refused for lack of memory; give a larger --memory");
  }
  const MapUsage& usage = run.usage;
  const Timing timing = timing_of(run.scans);
  std::printf("%s, %s into %s: of %s, %llu in range\n", counted(run.scans.size(), "scan").c_str(),
              counted(t.points_kept, "thinned point").c_str(), out.c_str(),
              counted(t.points, "return").c_str(), static_cast<unsigned long long>(t.in_range));
  std::printf("  time     median %.1f ms a scan, p99 %.1f ms, max %.1f ms\n", timing.median_ms,
              timing.p99_ms, timing.max_ms);
  print_registration(registration_of(run.scans));
  std::printf("  voxels   %llu labelled or occupied, %llu free%s\n",
              static_cast<unsigned long long>(usage.label_voxels),
              static_cast<unsigned long long>(run.free_voxels),
              run.in_submaps ? ", in the largest submap"
              : run.window   ? ", in memory after the last scan"
                             : "");
  std::printf(
      "  memory   %.1f MB used of %.1f MB, %.1f MB of it scratch, %.1f bytes a labelled or "
      "occupied voxel\n",
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
  if (run.window || run.in_submaps) {
    std::printf("  file     %llu voxels labelled or occupied, %llu free\n",
                static_cast<unsigned long long>(run.file.label_voxels),
                static_cast<unsigned long long>(run.file.free_voxels));
  }
  std::printf("  digest   %s\n", hex64(run.file.digest).c_str());
}

}  // namespace tessera
