// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The C interface: how things stand.
#include "tessera_c.hpp"

using namespace tessera;
using namespace tessera::c_interface;

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
  fill(filled, report);
  return TESSERA_OK;
}

tessera_status tessera_window(const tessera_robot* robot, tessera_window_report* report) {
  if (!is_robot(robot) || !can_fill(report)) return TESSERA_INVALID_ARGUMENT;
  const WindowReport& from = robot->robot->mapper().window();
  tessera_window_report filled{};
  filled.evicted = from.evicted;
  filled.evictions_refused = from.evictions_refused;
  filled.reloaded = from.reloaded;
  filled.merged = from.merged;
  filled.reloads_failed = from.reloads_failed;
  filled.steps_without_room = from.steps_without_room;
  filled.backlog = from.backlog;
  filled.most_backlog = from.most_backlog;
  filled.unpublished_blocks = from.unpublished_blocks;
  if (robot->archive != nullptr) {
    filled.archived_blocks = static_cast<std::uint32_t>(robot->archive->index().size());
    filled.merged += robot->archive->counts().evictions_merged;
  }
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

tessera_status tessera_global(const tessera_robot* robot, tessera_global_report* report) {
  if (!is_robot(robot) || !can_fill(report)) return TESSERA_INVALID_ARGUMENT;
  const GlobalMap& global = robot->robot->global();
  const GlobalMapReport from = global.report();
  tessera_global_report filled{};
  filled.settled = global.settled() ? 1U : 0U;
  filled.busy = global.busy() ? 1U : 0U;
  filled.blocks = from.blocks;
  filled.overlap_blocks = from.overlap_blocks;
  filled.waiting = from.waiting;
  filled.nodes = from.nodes;
  filled.residual = from.residual;
  filled.mean_variance = from.mean_variance;
  filled.used_bytes = from.used_bytes;
  filled.refused_blocks = from.refused_blocks;
  filled.refused_sums = from.refused_sums;
  filled.refused_outputs = from.refused_outputs;
  filled.torn_blocks = from.torn_blocks;
  filled.generation = global.generation();
  filled.contributions = from.replicas.contributions;
  filled.replica_blocks = from.replicas.blocks;
  filled.replica_bytes = from.replicas.used_bytes;
  filled.replicas_stale = from.replicas.stale;
  filled.replicas_refused_storage = from.replicas.refused_storage;
  filled.replicas_refused_quota = from.replicas.refused_quota;
  fill(filled, report);
  return TESSERA_OK;
}

tessera_status tessera_exchange(const tessera_robot* robot, tessera_exchange_report* report) {
  if (!is_robot(robot) || !can_fill(report)) return TESSERA_INVALID_ARGUMENT;
  const Exchange& exchange = robot->robot->exchange();
  const ExchangeReport from = exchange.report();
  tessera_exchange_report filled{};
  filled.contributions = from.contributions;
  filled.complete = from.complete;
  filled.peers = from.peers;
  filled.digest = exchange.digest();
  filled.received = from.received;
  filled.received_bytes = from.received_bytes;
  filled.refused_size = from.refused_size;
  filled.refused_format = from.refused_format;
  filled.refused_tag = from.refused_tag;
  filled.refused_signature = from.refused_signature;
  filled.refused_configuration = from.refused_configuration;
  filled.refused_replay = from.refused_replay;
  filled.refused_robot = from.refused_robot;
  filled.refused_excluded = from.refused_excluded;
  filled.refused_peers = from.refused_peers;
  filled.refused_body = from.refused_body;
  filled.own_echoes = from.own_echoes;
  filled.records_taken = from.records_taken;
  filled.records_stale = from.records_stale;
  filled.records_refused = from.records_refused;
  filled.records_early = from.records_early;
  filled.refused_contributions = from.refused_contributions;
  filled.displaced_contributions = from.displaced_contributions;
  filled.diverged = from.diverged;
  filled.impostors = from.impostors;
  filled.sent = from.sent;
  filled.sent_bytes = from.sent_bytes;
  filled.announcements = from.announcements;
  filled.requests = from.requests;
  filled.requests_saved = from.requests_saved;
  filled.frames = from.frames;
  filled.fresh_chunks = from.fresh_chunks;
  filled.answer_chunks = from.answer_chunks;
  filled.answer_bytes = from.answer_bytes;
  filled.answers_saved = from.answers_saved;
  filled.refused_answers = from.refused_answers;
  filled.published_parts = from.published_parts;
  filled.refused_parts = from.refused_parts;
  filled.waiting_answers = from.waiting_answers;
  filled.refused_mission = from.refused_mission;
  filled.refused_rate = from.refused_rate;
  filled.ended_contributions = from.ended_contributions;
  filled.refused_epochs = from.refused_epochs;
  filled.frames_early = from.frames_early;
  filled.conflicts = from.conflicts;
  filled.twins = from.twins;
  filled.statements = from.statements;
  filled.descriptions = from.descriptions;
  filled.conflict_proofs = from.conflict_proofs;
  filled.refused_disputed = from.refused_disputed;
  filled.banned = from.banned;
  fill(filled, report);
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
