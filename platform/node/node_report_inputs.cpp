// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The parts of a node's report that tell of its sensors, its vehicle and those who ask it.
#include "node/node.hpp"

namespace tessera {

namespace {

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
          {"unlabelled", m.unlabelled},
          {"partly_unlabelled", m.partly_unlabelled},
          {"sweep_beyond_poses", m.sweep_beyond_poses},
          {"images", m.images},
          {"images_out_of_order", m.images_out_of_order},
          {"poses", m.poses},
          {"poses_out_of_order", m.poses_out_of_order},
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
          {"messages", r.link.messages},
          {"malformed", r.link.malformed + faults},
          {"kernel_dropped", r.link.kernel_dropped},
          {"other_channel", r.other_channel},
          {"poses_used", status.poses},
          {"poses_refused", status.refused},
          {"poses_invalid", r.poses_invalid},
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
          {"foreign", port.inputs.foreign},
          {"misshapen", port.inputs.misshapen},
          {"sent", port.socket.sent},
          {"no_buffer", port.socket.no_buffer},
          {"given_up", port.frames_given_up},
          {"error_frames", port.socket.error_frames},
          {"bus_off", port.socket.bus_off},
          {"went_down", port.socket.went_down},
          {"reopened", port.reopened},
          {"kernel_dropped", port.socket.kernel_dropped},
          {"stale", port.socket.stale},
          {"pose_timeouts", port.pose_timeouts},
          {"relocations", port.relocations}};
}

Json Node::queries_json() const {
  const QueryPortReport r = queries_->report();
  Json errors = Json::array();
  for (const std::uint64_t count : r.queries.errors) errors.push_back(count);
  return {{"answered", r.queries.errors[0]},
          {"by_error", std::move(errors)},
          {"incomplete", r.queries.incomplete},
          {"malformed", r.malformed},
          {"not_sent", r.not_sent},
          {"most_work", r.queries.most_work}};
}

}  // namespace tessera
