// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The parts of a node's report about its sensors, its vehicle and queries.
#include <array>

#include "node/node.hpp"

namespace tessera {

namespace {

template <std::size_t kCount>
Json counts_json(const std::array<std::uint64_t, kCount>& counts) {
  Json json = Json::array();
  for (const std::uint64_t count : counts) json.push_back(count);
  return json;
}

Json fragments_json(const AssemblerReport& r) {
  return {{"taken", r.taken},
          {"malformed", r.malformed},
          {"too_large", r.too_large},
          {"inconsistent", r.inconsistent},
          {"duplicates", r.duplicates},
          {"messages", r.messages},
          {"torn", r.torn},
          {"timed_out", r.timed_out},
          {"superseded", r.superseded},
          {"evicted", r.evicted}};
}

Json match_json(const MatchReport& m) {
  return {{"given", m.given},
          {"unknown_sensor", m.unknown_sensor},
          {"future", m.scans.future},
          {"ancient", m.scans.ancient},
          {"duplicates", m.duplicates},
          {"out_of_order", m.out_of_order},
          {"without_pose", m.without_pose},
          {"without_images", m.without_images},
          {"superseded", m.superseded},
          {"dropped_by_step", m.dropped_by_step},
          {"unlabelled", m.unlabelled},
          {"partly_unlabelled", m.partly_unlabelled},
          {"sweep_beyond_poses", m.sweep_beyond_poses},
          {"images", m.images},
          {"unknown_camera", m.unknown_camera},
          {"images_future", m.image_stamps.future},
          {"images_ancient", m.image_stamps.ancient},
          {"images_out_of_order", m.images_out_of_order},
          {"poses", m.poses},
          {"poses_future", m.pose_stamps.future},
          {"poses_ancient", m.pose_stamps.ancient},
          {"poses_out_of_order", m.poses_out_of_order},
          {"poses_not_rigid", m.poses_not_rigid},
          {"clock_steps", m.clock_steps}};
}

Json registration_json(const RegistrarReport& r) {
  return {{"deskewed", r.deskewed},
          {"not_deskewed", r.not_deskewed},
          {"points_unplaced", r.points_unplaced},
          {"projected", r.projected},
          {"labelled", r.labelled},
          {"occluded", r.occluded},
          {"images_without_pose", r.images_without_pose},
          {"images_refused", r.images_refused},
          {"depth_images", r.depth_images},
          {"flying", r.flying},
          {"refused", r.refused}};
}

}  // namespace

Json Node::sensors_json() const {
  const SensorReport r = sensing_->report();
  SensingStatus status;
  static_cast<void>(sensing_->status().get(status));
  RegistrarReport registration;
  static_cast<void>(registrar_->report().get(registration));
  std::uint64_t faults = 0;
  for (const std::uint64_t count : r.faults) faults += count;
  return {{"datagrams", r.link.datagrams},
          {"bytes", r.link.bytes},
          {"messages", r.link.messages},
          {"malformed", r.link.malformed + faults},
          {"by_fault", counts_json(r.faults)},
          {"fragments", fragments_json(r.link.fragments)},
          {"kernel_dropped", r.link.kernel_dropped},
          {"other_channel", r.other_channel},
          {"poses_used", status.poses},
          {"poses_refused", status.refused},
          {"poses_invalid", r.poses_invalid},
          {"poses_filtered", r.poses_filtered},
          {"poses_queue_full", r.poses_queue_full},
          {"pose_gaps", r.pose_gaps},
          {"pauses", status.pauses},
          {"silences", status.silences},
          {"relocations", status.relocations},
          {"longest_match_ms", 1e-3 * static_cast<double>(r.longest_match_us)},
          {"match", match_json(r.match)},
          {"registration", registration_json(registration)}};
}

Json Node::vehicle_json() const {
  VehicleThreadReport thread;
  static_cast<void>(vehicle_->report().get(thread));
  VehiclePortStatus port;
  static_cast<void>(vehicle_port_->status(port));
  return {{"interface", config_.vehicle.can},
          {"reports", thread.reports},
          {"sweeps", thread.sweeps},
          {"commands", thread.commands},
          {"late", thread.late},
          {"frames", port.inputs.frames},
          {"accepted", port.inputs.accepted},
          {"refused", port.inputs.refused},
          {"by_status", counts_json(port.inputs.by_status)},
          {"foreign", port.inputs.foreign},
          {"misshapen", port.inputs.misshapen},
          {"incomplete_poses", port.inputs.incomplete_poses},
          {"invalid_poses", port.inputs.invalid_poses},
          {"invalid_odometry", port.inputs.invalid_odometry},
          {"invalid_states", port.inputs.invalid_states},
          {"unknown_commands", port.inputs.unknown_commands},
          {"verdicts", counts_json(port.verdicts)},
          {"pose_timeouts", port.pose_timeouts},
          {"relocations", port.relocations},
          {"poses_dropped", port.poses_dropped},
          {"commands_dropped", port.commands_dropped},
          {"cycles_skipped", port.cycles_skipped},
          {"frames_retried", port.frames_retried},
          {"given_up", port.frames_given_up},
          {"reopened", port.reopened},
          {"received", port.socket.received},
          {"socket_foreign", port.socket.foreign},
          {"kernel_dropped", port.socket.kernel_dropped},
          {"sent", port.socket.sent},
          {"no_buffer", port.socket.no_buffer},
          {"send_failed", port.socket.send_failed},
          {"error_frames", port.socket.error_frames},
          {"error_warnings", port.socket.error_warnings},
          {"error_passive", port.socket.error_passive},
          {"bus_off", port.socket.bus_off},
          {"restarted", port.socket.restarted},
          {"overflows", port.socket.overflows},
          {"no_acknowledge", port.socket.no_acknowledge},
          {"went_down", port.socket.went_down},
          {"stale", port.socket.stale},
          {"no_stamp", port.socket.no_stamp}};
}

Json Node::queries_json() const {
  const QueryPortReport r = queries_->report();
  return {{"answered", r.queries.errors[0]},
          {"by_error", counts_json(r.queries.errors)},
          {"incomplete", r.queries.incomplete},
          {"malformed", r.malformed},
          {"queue_full", r.queue_full},
          {"not_sent", r.not_sent},
          {"work", r.queries.work},
          {"most_work", r.queries.most_work}};
}

Json Node::view_json() const {
  const ViewerReport r = view_->report();
  return {{"connections", r.web.connections},
          {"requests", r.web.requests},
          {"refused_method", r.web.refused_method},
          {"refused_host", r.web.refused_host},
          {"refused_site", r.web.refused_site},
          {"refused_body", r.web.refused_body},
          {"refused_path", r.web.refused_path},
          {"refused_busy", r.web.refused_busy},
          {"stalled", r.web.stalled},
          {"dropped", r.web.dropped},
          {"messages", r.messages},
          {"blocks", r.blocks},
          {"bytes", r.bytes},
          {"deferred", r.deferred},
          {"heap_allocations", view_->heap_allocations()}};
}

Json Node::security_json() const {
  const FleetView fleet = fleet_->view();
  const SideStatistics link = port_->link().side_statistics();
  const StatusCounters& table = fleet.counters;
  SharingStatus sharing;
  static_cast<void>(sharing_->status().get(sharing));
  Json conflicts = Json::array();
  for (const ContributionId& id : std::span(sharing.conflicts).first(sharing.conflict_count))
    conflicts.push_back({{"robot", id.robot}, {"epoch", id.epoch}});
  // Statuses that the link refused never reach the table.
  return {{"excluded", excluded_},
          {"exclude_digest", exclude_digest_},
          {"exclude_differs", fleet.differ()},
          {"conflicts", std::move(conflicts)},
          {"floors_refused", sharing.floors_refused + state_->floors_refused()},
          {"statuses",
           {{"taken", table.taken},
            {"refused_format", link.refused_format},
            {"refused_tag", link.refused_tag},
            {"refused_excluded", link.refused_excluded},
            {"queue_full", link.queue_full},
            {"refused_robot", table.refused_robot},
            {"refused_replay", table.refused_replay},
            {"refused_rate", table.refused_rate},
            {"refused_signature", table.refused_signature},
            {"refused_places", table.refused_places}}}};
}

}  // namespace tessera
