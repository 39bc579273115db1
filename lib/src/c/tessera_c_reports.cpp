// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The C interface: how things stand.
#include "tessera_c.hpp"

using namespace tessera;
using namespace tessera::c_interface;

namespace {

void fill_replicas(const ReplicasUsage& from, tessera_global_report& filled) noexcept {
  TESSERA_REPLICA_COUNTERS(TESSERA_FILL)
}

}  // namespace

extern "C" {

tessera_status tessera_submap(const tessera_robot* robot, tessera_submap_report* report) {
  if (!is_robot(robot) || !can_fill(report)) return TESSERA_INVALID_ARGUMENT;
  const SubmapReport& from = robot->robot->sharer().submap();
  tessera_submap_report filled{};
  filled.epoch = from.epoch;
  filled.submap = from.submap;
  filled.ending = from.ending ? 1U : 0U;
  filled.opened = from.opened;
  filled.cut_short = from.cut_short;
  filled.lost_blocks = from.lost_blocks;
  filled.last = static_cast<std::uint32_t>(from.last);
  filled.mapping = robot->robot->maps().number();
  filled.revision = from.revision;
  filled.corrections = from.corrections;
  filled.refused_corrections = from.refused_corrections;
  filled.refused_frames = from.refused_frames;
  filled.corrected_most_m = from.corrected_most_m;
  fill(filled, report);
  return TESSERA_OK;
}

tessera_status tessera_window(const tessera_robot* robot, tessera_window_report* report) {
  if (!is_robot(robot) || !can_fill(report)) return TESSERA_INVALID_ARGUMENT;
  const WindowReport& from = robot->robot->mapper().window();
  tessera_window_report filled{};
  TESSERA_WINDOW_COUNTERS(TESSERA_FILL)
  if (robot->archive != nullptr) {
    filled.archived_blocks = static_cast<std::uint32_t>(robot->archive->index().size());
    filled.merged += robot->archive->counts().evictions_merged;
  }
  fill(filled, report);
  return TESSERA_OK;
}

tessera_status tessera_objections(const tessera_robot* robot, tessera_objections_report* report) {
  if (!is_robot(robot) || !can_fill(report)) return TESSERA_INVALID_ARGUMENT;
  const ObjectionsReport& from = robot->robot->sharer().objections();
  tessera_objections_report filled{};
  TESSERA_OBJECTION_COUNTERS(TESSERA_FILL)
  fill(filled, report);
  return TESSERA_OK;
}

tessera_status tessera_map_usage_of(const tessera_robot* robot, uint32_t map,
                                    tessera_map_usage* usage) {
  if (!is_robot(robot) || !is_map(map) || !can_fill(usage)) return TESSERA_INVALID_ARGUMENT;
  const MapUsage from = map_of(*robot, map).usage();
  tessera_map_usage filled{};
  filled.capacity_bytes = from.capacity_bytes;
  filled.used_bytes = from.used_bytes;
  filled.peak_bytes = from.peak_bytes;
  filled.blocks = from.blocks;
  filled.label_voxels = from.label_voxels;
  filled.blocks_refused = from.blocks_refused;
  filled.storage_refused = from.storage_refused;
  fill(filled, usage);
  return TESSERA_OK;
}

tessera_status tessera_reliability(const tessera_robot* robot, uint32_t of_robot, uint32_t label,
                                   tessera_reliability_report* report) {
  if (!is_robot(robot) || !can_fill(report)) return TESSERA_INVALID_ARGUMENT;
  const GlobalMap& global = robot->robot->global();
  const Result<RobotReliability> whole = global.reliability(of_robot);
  if (!whole.ok() || label > static_cast<std::uint32_t>(kMaxClasses)) return TESSERA_OUT_OF_RANGE;
  tessera_reliability_report filled{};
  filled.reliability = whole->reliability;
  filled.agreement = whole->agreement;
  filled.judged = whole->judged;
  filled.named = whole->named;
  if (label == 0) {
    filled.shared = whole->shared;
    filled.differing = whole->differing;
  } else {
    const Result<ClassReliability> one = global.reliability(of_robot, static_cast<int>(label));
    if (!one.ok()) return TESSERA_OUT_OF_RANGE;
    filled.reliability = one->reliability;
    filled.agreement = one->agreement;
    filled.judged = one->judged;
    filled.named &= std::uint64_t{1} << label;
  }
  fill(filled, report);
  return TESSERA_OK;
}

tessera_status tessera_global(const tessera_robot* robot, tessera_global_report* report) {
  if (!is_robot(robot) || !can_fill(report)) return TESSERA_INVALID_ARGUMENT;
  const GlobalMap& global = robot->robot->global();
  const GlobalMapReport from = global.report();
  tessera_global_report filled{};
  filled.settled = global.settled() ? 1U : 0U;
  filled.busy = global.busy() ? 1U : 0U;
  TESSERA_GLOBAL_STATE(TESSERA_FILL)
  TESSERA_GLOBAL_FIGURES(TESSERA_FILL)
  TESSERA_GLOBAL_COUNTERS(TESSERA_FILL)
  TESSERA_GLOBAL_COUNTERS_LATER(TESSERA_FILL)
  filled.generation = global.generation();
  fill_replicas(from.replicas, filled);
  fill(filled, report);
  return TESSERA_OK;
}

tessera_status tessera_exchange(const tessera_robot* robot, tessera_exchange_report* report) {
  if (!is_robot(robot) || !can_fill(report)) return TESSERA_INVALID_ARGUMENT;
  const Exchange& exchange = robot->robot->exchange();
  const ExchangeReport from = exchange.report();
  tessera_exchange_report filled{};
  TESSERA_EXCHANGE_STATE(TESSERA_FILL)
  filled.digest = exchange.digest();
  TESSERA_EXCHANGE_COUNTERS(TESSERA_FILL)
  fill(filled, report);
  return TESSERA_OK;
}

tessera_status tessera_teammate_at(const tessera_robot* robot, uint32_t index, int64_t now_us,
                                   tessera_teammate* teammate) {
  if (!is_robot(robot) || !is_time(now_us) || !can_fill(teammate)) return TESSERA_INVALID_ARGUMENT;
  const Result<TeammatePlace> from = robot->robot->sharer().teammate_at(index, now_us);
  if (!from.ok()) return status_of(from.status());
  tessera_teammate filled{};
  filled.robot = from->robot;
  std::copy_n(from->T_map_body.data(), 12, filled.T_global_body);
  std::copy_n(from->box.low.begin(), 3, filled.low);
  std::copy_n(from->box.high.begin(), 3, filled.high);
  std::copy_n(from->velocity.data(), 3, filled.velocity);
  filled.margin_m = from->margin_m;
  filled.speed_m_per_s = static_cast<double>(from->speed_m_per_s);
  filled.until_us = from->until.us();
  fill(filled, teammate);
  return TESSERA_OK;
}

tessera_status tessera_contribution_at(const tessera_robot* robot, uint32_t index,
                                       tessera_contribution* contribution) {
  if (!is_robot(robot) || !can_fill(contribution)) return TESSERA_INVALID_ARGUMENT;
  const Result<ContributionState> from = robot->robot->exchange().contribution_at(index);
  if (!from.ok()) return status_of(from.status());
  tessera_contribution filled{};
  filled.robot = from->id.robot;
  filled.epoch = from->id.epoch;
  filled.submap = from->id.submap;
  filled.own = from->own ? 1U : 0U;
  filled.complete = from->complete ? 1U : 0U;
  filled.latest = from->latest;
  filled.covered = from->covered;
  filled.digest = from->digest;
  fill(filled, contribution);
  return TESSERA_OK;
}

}  // extern "C"
