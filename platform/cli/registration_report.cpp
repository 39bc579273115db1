// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/registration_report.hpp"

#include <algorithm>
#include <cstdio>

#include "base/counters_json.hpp"
#include "base/number_text.hpp"
#include "cli/command.hpp"

namespace tessera {

namespace {

/// A report of a scan: its status, and all of its numbers.
template <class Report>
Json scan_json(const Report& report) {
  Json json = counters_json(report);
  json["status"] = to_string(report.status);
  return json;
}

/// True if the scan had this camera: it saw something, or reports why not.
bool took_part(const LabelCameraReport& camera) {
  return camera.status != Status::kOk ||
         std::any_of(kCounters<LabelCameraReport>.begin(), kCounters<LabelCameraReport>.end(),
                     [&](const auto& row) { return row.value(camera) > 0; });
}

Json projection_json(const LabelReport& report) {
  Json json = counters_json(report);
  json["cameras"] = Json::array();
  for (const LabelCameraReport& camera : report.cameras)
    if (took_part(camera)) json["cameras"].push_back(scan_json(camera));
  return json;
}

double percent(std::uint64_t part, std::uint64_t whole) {
  return whole == 0 ? 0.0 : 100.0 * static_cast<double>(part) / static_cast<double>(whole);
}

}  // namespace

void write_registration(const RegistrationRecord& record, Json& scan) {
  if (record.deskew) scan["deskew"] = scan_json(*record.deskew);
  if (record.projection) scan["projection"] = projection_json(*record.projection);
  if (record.depth) scan["depth"] = counters_json(*record.depth);
}

void write_registration(const RegistrarReport& r, Json& totals) {
  if (r.deskewed + r.not_deskewed > 0)
    totals["deskew"] = {{"scans", r.deskewed + r.not_deskewed},
                        {"scans_without_pose", r.not_deskewed},
                        {"moved", r.moved},
                        {"unplaced", r.points_unplaced}};
  if (r.projected > 0)
    totals["projection"] = {{"scans", r.projected},
                            {"points", r.projected_points},
                            {"labelled", r.labelled},
                            {"occluded", r.occluded},
                            {"cameras_left_out", r.images_without_pose}};
  if (r.depth_images > 0)
    totals["depth"] = {{"images", r.depth_images},
                       {"points", r.depth_points},
                       {"no_depth", r.no_depth},
                       {"refused", r.depth_refused}};
}

void print_registration(const RegistrarReport& r) {
  if (r.deskewed + r.not_deskewed > 0)
    std::printf("  motion   corrected for %s\n", counted(r.moved, "point").c_str());
  if (r.projected > 0)
    std::printf("  cameras  labelled %.1f %% of the points\n",
                percent(r.labelled, r.projected_points));
  if (r.depth_images > 0)
    std::printf("  depth    %s of %s\n", counted(r.depth_points, "point").c_str(),
                counted(r.depth_points + r.no_depth + r.depth_refused, "pixel").c_str());
  if (r.depth_images > 0 && r.depth_points == 0)
    warn("no pixel has a usable depth; check depth_scale, min_depth and max_depth");
  if (r.not_deskewed > 0)
    warn(counted(r.not_deskewed, "scan") +
         " not deskewed: there is no pose at the stamp; give poses from the first point of the "
         "first scan to the last point of the last");
  if (r.points_unplaced > 0)
    warn(counted(r.points_unplaced, "point") +
         " not deskewed: no time, or no pose before or after it");
  if (r.images_without_pose > 0)
    warn(counted(r.images_without_pose, "image") +
         " left out: there is no pose at the time of the image or of the scan");
}

}  // namespace tessera
