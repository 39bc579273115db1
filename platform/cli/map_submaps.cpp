// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/map_submaps.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "base/number_text.hpp"
#include "cli/correction_files.hpp"
#include "scans/poses.hpp"
#include "scans/scan_motion.hpp"
#include "tessera/base/rigid.hpp"
#include "tessera/submap/frame_fit.hpp"

namespace tessera {

namespace {

Point3d place_of(const Matrix34d& T) { return T.col(3); }

/// Where a frame puts a scan.
template <class Placed>
Point3d apply_to(const Matrix34d& T_world_map, const Placed& scan) {
  return tessera::apply(T_world_map, place_of(scan.T_map_sensor));
}

}  // namespace

Outcome<void> check_submaps(const MapOptions& options) {
  const SettingName& length = kMapSettings["--submap-length"];
  if (!options.in_submaps()) {
    if (options.corrections.empty()) return {};
    return Failure{Message("--corrections needs ") + Message(length) +
                   ": what is corrected are the frames of submaps"};
  }
  const auto refused = [&](const SettingName& other) {
    return Failure{Message(length) + " and " + Message(other) +
                   " do not go together; leave out one"};
  };
  if (!options.continue_from.empty()) return refused(kMapFileSettings["--continue"]);
  if (!options.prior_map.empty()) return refused(kMapFileSettings["--prior-map"]);
  if (options.window_m) return refused(kMapSettings["--window"]);
  if (!options.archive.empty()) return refused(kMapSettings["--archive"]);
  return {};
}

Outcome<std::unique_ptr<MapSubmaps>> MapSubmaps::make(const MapOptions& options,
                                                      const MapIdentity& identity,
                                                      const LocalMap& empty) {
  std::vector<Correction> corrections;
  TESSERA_TRY_ASSIGN(std::vector<CorrectionFile> files,
                     read_corrections(options.corrections, options));
  for (CorrectionFile& file : files)
    corrections.push_back({.path = file.path, .rows = std::move(file.rows)});
  TESSERA_TRY_ASSIGN(SubmapWriter writer, SubmapWriter::open(options.out, empty, identity));
  std::unique_ptr<MapSubmaps> made(new MapSubmaps(std::move(writer), *options.submap_length_m));
  made->corrections_ = std::move(corrections);
  const std::string times = options.folder() + "/times.txt";
  if (std::filesystem::exists(times)) {
    TESSERA_TRY_ASSIGN(made->times_us_, read_times(times));
  }
  return made;
}

Outcome<void> MapSubmaps::begin_scan(const Scan& scan, const ScanView& view, Mapper& mapper) {
  // It is refused, and belongs to none.
  if (check_rigid(view.T_map_sensor) != Status::kOk) return {};
  TESSERA_TRY(check_stamps(scan));
  const std::int64_t at_us = stamp_us(scan);
  const bool ended = cutter_.note(view.T_map_sensor.col(3), at_us).has_value() && !placed_.empty();
  if (ended) {
    TESSERA_TRY(seal(mapper));
    cutter_.begin();
    frames_.push_back(frames_.back());
    revisions_.push_back(1);
  }
  if (ended || placed_.empty()) firsts_.push_back(placed_.size());
  lengths_m_.resize(firsts_.size());
  lengths_m_.back() = cutter_.way_m();
  placed_.push_back({scan.number, 1e-6 * static_cast<double>(at_us), view.T_map_sensor});
  return {};
}

std::int64_t MapSubmaps::stamp_us(const Scan& scan) const {
  const auto number = static_cast<std::size_t>(scan.number);
  return scan.stamp_us == 0 && number < times_us_.size() ? times_us_[number] : scan.stamp_us;
}

Outcome<void> MapSubmaps::check_stamps(const Scan& scan) const {
  if (scan.stamp_us != 0 || !times_us_.empty()) return {};
  for (const Correction& correction : corrections_) {
    if (correction.rows.stamps_s.empty()) continue;
    return Failure{correction.path +
                   " has stamps, but the scans have none; give poses without stamps, a row for "
                   "each scan, or times.txt beside the scans"};
  }
  return {};
}

Outcome<void> MapSubmaps::seal(Mapper& mapper) {
  const MapUsage usage = mapper.map().usage();
  if (usage.used_bytes > largest_.used_bytes) {
    largest_ = usage;
    largest_free_voxels_ = mapper.map().count_free_voxels();
  }
  SubmapRow row;
  row.number = static_cast<std::uint32_t>(writer_.rows().size());
  row.first_scan = static_cast<std::uint32_t>(placed_[firsts_.back()].number);
  row.last_scan = static_cast<std::uint32_t>(placed_.back().number);
  row.length_m = lengths_m_.back();
  TESSERA_TRY(writer_.add(mapper.map(), row));
  mapper.clear();
  return {};
}

void MapSubmaps::end_scan() {
  for (Correction& correction : corrections_) {
    if (!correction.applied && is_due(correction)) apply(correction);
  }
}

bool MapSubmaps::is_due(const Correction& correction) const {
  if (placed_.empty()) return false;
  const PoseRows& rows = correction.rows;
  if (!rows.stamps_s.empty()) return placed_.back().stamp_s >= rows.stamps_s.back();
  return static_cast<std::size_t>(placed_.back().number) + 1 >= rows.T_map_sensor.size();
}

std::optional<Matrix34d> MapSubmaps::corrected(const Correction& correction, const Placed& scan) {
  const PoseRows& rows = correction.rows;
  const auto rigid = [&](std::size_t i) -> std::optional<Matrix34d> {
    if (check_rigid(rows.T_map_sensor[i]) != Status::kOk) return std::nullopt;
    return rows.T_map_sensor[i];
  };
  if (rows.stamps_s.empty()) {
    const auto row = static_cast<std::size_t>(scan.number);
    return row < rows.T_map_sensor.size() ? rigid(row) : std::nullopt;
  }
  const auto& stamps = rows.stamps_s;
  if (scan.stamp_s < stamps.front() || scan.stamp_s > stamps.back()) return std::nullopt;
  const auto after = static_cast<std::size_t>(
      std::lower_bound(stamps.begin(), stamps.end(), scan.stamp_s) - stamps.begin());
  if (after == 0 || !(stamps[after] > scan.stamp_s)) return rigid(after);
  const auto from = rigid(after - 1);
  const auto to = rigid(after);
  if (!from || !to) return std::nullopt;
  const double share = (scan.stamp_s - stamps[after - 1]) / (stamps[after] - stamps[after - 1]);
  return interpolate(*from, *to, share);
}

/// Submaps of which it has no pose continue from the last one that it has.
void MapSubmaps::apply(Correction& correction) {
  correction.applied = true;
  correction.after_scan = placed_.back().number;
  std::optional<Matrix34d> last;
  double squares = 0.0;
  std::size_t poses = 0;
  for (std::size_t submap = 0; submap < firsts_.size(); ++submap) {
    const std::size_t begin = firsts_[submap];
    const std::size_t end = submap + 1 < firsts_.size() ? firsts_[submap + 1] : placed_.size();
    FrameFit fit;
    for (std::size_t i = begin; i < end; ++i) {
      const std::optional<Matrix34d> pose = corrected(correction, placed_[i]);
      if (!pose) continue;
      fit.add(placed_[i].T_map_sensor, *pose);
      last = product(*pose, inverse(placed_[i].T_map_sensor));
    }
    const Result<Matrix34d> fitted = fit.fit();
    if (!fitted.ok() && !last) continue;
    const Result<Matrix34d> rounded = round_rigid(fitted.ok() ? *fitted : *last);
    if (!rounded.ok()) continue;
    for (std::size_t i = begin; i < end; ++i) {
      const std::optional<Matrix34d> pose = corrected(correction, placed_[i]);
      if (!pose) continue;
      squares += squared_norm(apply_to(*rounded, placed_[i]) - place_of(*pose));
      ++poses;
    }
    if (*rounded == frames_[submap]) continue;
    const Placed& middle = placed_[begin + (end - begin) / 2];
    const double moved_m = norm(apply_to(*rounded, middle) - apply_to(frames_[submap], middle));
    correction.most_m = std::max(correction.most_m, moved_m);
    ++correction.moved;
    ++revisions_[submap];
    frames_[submap] = *rounded;
  }
  correction.residual_m = poses == 0 ? 0.0 : std::sqrt(squares / static_cast<double>(poses));
}

Outcome<MapSummary> MapSubmaps::finish(Mapper& mapper) {
  TESSERA_TRY(seal(mapper));
  for (Correction& correction : corrections_) {
    if (!correction.applied) apply(correction);
  }
  for (std::size_t i = 0; i < writer_.rows().size(); ++i) {
    writer_.rows()[i].T_map_submap = *encode_rigid(frames_[i]);
    writer_.rows()[i].revision = revisions_[i];
  }
  TESSERA_TRY(writer_.commit());
  return summary_of(writer_.rows());
}

void MapSubmaps::write(Json& json) const {
  json["submaps"] = Json::array();
  for (const SubmapRow& row : writer_.rows()) json["submaps"].push_back(to_json(row));
  json["corrections"] = Json::array();
  for (const Correction& correction : corrections_) {
    json["corrections"].push_back({{"file", correction.path},
                                   {"rows", correction.rows.T_map_sensor.size()},
                                   {"after_scan", correction.after_scan},
                                   {"submaps_moved", correction.moved},
                                   {"most_m", correction.most_m},
                                   {"residual_m", correction.residual_m}});
  }
}

std::string MapSubmaps::summary() const {
  std::string text = counted(writer_.rows().size(), "submap");
  if (corrections_.empty()) return text;
  const Correction& last = corrections_.back();
  return text + fmt::format(", {}; the last one moved {} by up to {:.2f} m and leaves {:.3f} m",
                            counted(corrections_.size(), "correction"),
                            counted(last.moved, "submap"), last.most_m, last.residual_m);
}

}  // namespace tessera
