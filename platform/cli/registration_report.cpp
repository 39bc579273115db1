// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/registration_report.hpp"

#include <cstdio>

#include "base/number_text.hpp"
#include "cli/command.hpp"

namespace tessera {

namespace {

Json camera_json(const LabelCameraReport& camera) {
  return {{"status", to_string(camera.status)},
          {"labelled", camera.labelled},
          {"occluded", camera.occluded},
          {"outside", camera.outside},
          {"behind", camera.behind},
          {"masked", camera.masked},
          {"unknown", camera.unknown},
          {"better_other", camera.better_other}};
}

/// True if the scan had this camera: it saw something, or reports why not.
bool took_part(const LabelCameraReport& c) {
  return c.status != Status::kOk ||
         c.labelled + c.occluded + c.outside + c.behind + c.masked + c.unknown + c.better_other > 0;
}

Json projection_json(const LabelReport& report) {
  Json json = {{"labelled", report.labelled}, {"cells_read", report.cells_read}};
  json["cameras"] = Json::array();
  for (const LabelCameraReport& camera : report.cameras)
    if (took_part(camera)) json["cameras"].push_back(camera_json(camera));
  return json;
}

Json depth_json(const DepthReport& depth) {
  return {{"points", depth.points},        {"no_depth", depth.no_depth},
          {"too_near", depth.too_near},    {"too_far", depth.too_far},
          {"flying", depth.flying},        {"no_ray", depth.no_ray},
          {"unlabelled", depth.unlabelled}};
}

double percent(std::uint64_t part, std::uint64_t whole) {
  return whole == 0 ? 0.0 : 100.0 * static_cast<double>(part) / static_cast<double>(whole);
}

}  // namespace

void write_registration(const RegistrationRecord& record, Json& scan) {
  if (record.deskew) {
    const DeskewReport& d = *record.deskew;
    scan["deskew"] = {{"status", to_string(d.status)},
                      {"moved", d.moved},
                      {"bad_time", d.bad_time},
                      {"without_pose", d.without_pose}};
  }
  if (record.projection) scan["projection"] = projection_json(*record.projection);
  if (record.depth) scan["depth"] = depth_json(*record.depth);
}

void RegistrationTotals::add(const RegistrationRecord& record) {
  if (record.deskew) {
    ++swept_scans;
    not_deskewed_scans += record.deskew->status == Status::kOk ? 0U : 1U;
    moved += record.deskew->moved;
    unplaced += record.deskew->bad_time + record.deskew->without_pose;
  }
  if (record.depth) {
    const DepthReport& d = *record.depth;
    ++depth_images;
    depth_points += d.points;
    no_depth += d.no_depth;
    depth_refused += d.too_near + d.too_far + d.flying + d.no_ray;
  }
  if (!record.projection) return;
  ++projected_scans;
  points += record.projection->points;
  labelled += record.projection->labelled;
  for (const LabelCameraReport& camera : record.projection->cameras) {
    occluded += camera.occluded;
    cameras_left_out += camera.status == Status::kOk ? 0U : 1U;
  }
}

void RegistrationTotals::write(Json& totals) const {
  if (swept_scans > 0)
    totals["deskew"] = {{"scans", swept_scans},
                        {"scans_without_pose", not_deskewed_scans},
                        {"moved", moved},
                        {"unplaced", unplaced}};
  if (projected_scans > 0)
    totals["projection"] = {{"scans", projected_scans},
                            {"points", points},
                            {"labelled", labelled},
                            {"occluded", occluded},
                            {"cameras_left_out", cameras_left_out}};
  if (depth_images > 0)
    totals["depth"] = {{"images", depth_images},
                       {"points", depth_points},
                       {"no_depth", no_depth},
                       {"refused", depth_refused}};
}

void RegistrationTotals::print() const {
  if (swept_scans > 0)
    std::printf("  motion   corrected for %s\n", counted(moved, "point").c_str());
  if (projected_scans > 0)
    std::printf("  cameras  labelled %.1f %% of the points\n", percent(labelled, points));
  if (depth_images > 0)
    std::printf("  depth    %s of %s\n", counted(depth_points, "point").c_str(),
                counted(depth_points + no_depth + depth_refused, "pixel").c_str());
  if (depth_images > 0 && depth_points == 0)
    warn("no pixel has a usable depth; check depth_scale, min_depth and max_depth");
  if (not_deskewed_scans > 0)
    warn(counted(not_deskewed_scans, "scan") +
         " not deskewed: there is no pose at the stamp; give poses from the first point of the "
         "first scan to the last point of the last");
  if (unplaced > 0)
    warn(counted(unplaced, "point") + " not deskewed: no time, or no pose before or after it");
  if (cameras_left_out > 0)
    warn(counted(cameras_left_out, "image") +
         " left out: there is no pose at the time of the image or of the scan");
}

}  // namespace tessera
