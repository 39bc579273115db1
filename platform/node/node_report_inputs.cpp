// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The parts of a node's report about its sensors, its vehicle and queries.
#include <array>

#include "base/counters_json.hpp"
#include "node/node.hpp"

namespace tessera {

namespace {

template <std::size_t kCount>
Json counts_json(const std::array<std::uint64_t, kCount>& counts) {
  Json json = Json::array();
  for (const std::uint64_t count : counts) json.push_back(count);
  return json;
}

Json match_json(const MatchReport& m) {
  Json json = counters_json(m);
  json["future"] = m.scans.future;
  json["ancient"] = m.scans.ancient;
  json["images_future"] = m.image_stamps.future;
  json["images_ancient"] = m.image_stamps.ancient;
  json["poses_future"] = m.pose_stamps.future;
  json["poses_ancient"] = m.pose_stamps.ancient;
  return json;
}

}  // namespace

Json Node::sensors_json() const {
  const SensorReport r = sensing_->report();
  SensingThreadState status;
  static_cast<void>(sensing_->state().get(status));
  RegistrarReport registration;
  static_cast<void>(registrar_->report().get(registration));
  std::uint64_t faults = 0;
  for (const std::uint64_t count : r.faults) faults += count;
  return {{"datagrams", r.link.datagrams},
          {"bytes", r.link.bytes},
          {"messages", r.link.messages},
          {"malformed", r.link.malformed + faults},
          {"by_fault", counts_json(r.faults)},
          {"fragments", counters_json(r.link.fragments)},
          {"kernel_dropped", r.link.kernel_dropped},
          {"other_channel", r.other_channel},
          {"poses_used", status.poses},
          {"poses_refused", status.refused},
          {"poses_invalid", r.poses_invalid},
          {"poses_filtered", r.poses_filtered},
          {"poses_queue_full", r.poses_queue_full},
          {"pose_gaps", r.pose_gaps},
          {"corrections", r.corrections},
          {"corrections_foreign", r.corrections_foreign},
          {"corrections_dropped", r.corrections_dropped},
          {"pauses", status.pauses},
          {"silences", status.silences},
          {"relocations", status.relocations},
          {"longest_match_ms", 1e-3 * static_cast<double>(r.longest_match_us)},
          {"match", match_json(r.match)},
          {"registration", counters_json(registration)}};
}

Json Node::vehicle_json() const {
  VehicleThreadReport thread;
  static_cast<void>(vehicle_->report().get(thread));
  VehiclePortState port;
  static_cast<void>(vehicle_port_->status(port));
  Json json = counters_json(port.socket);
  // The inputs have one of that name too.
  json["socket_foreign"] = port.socket.foreign;
  json.erase("foreign");
  add_counters(json, port.inputs);
  add_counters(json, port);
  add_counters(json, thread);
  json["interface"] = config_.vehicle.can;
  json["by_status"] = counts_json(port.inputs.by_status);
  json["verdicts"] = counts_json(port.verdicts);
  json["given_up"] = port.frames_given_up;
  return json;
}

Json Node::queries_json() const {
  const QueryPortReport r = queries_->report();
  Json json = counters_json(r);
  add_counters(json, r.queries);
  json["answered"] = r.queries.errors[0];
  json["by_error"] = counts_json(r.queries.errors);
  return json;
}

Json Node::view_json() const {
  const ViewerReport r = view_->report();
  Json json = counters_json(r.web);
  add_counters(json, r);
  json["heap_allocations"] = view_->heap_allocations();
  return json;
}

Json Node::security_json() const {
  const FleetView fleet = fleet_->view();
  SharingThreadState sharing;
  static_cast<void>(sharing_->state().get(sharing));
  Json conflicts = Json::array();
  for (const ContributionId& id : std::span(sharing.conflicts).first(sharing.conflict_count))
    conflicts.push_back({{"robot", id.robot}, {"epoch", id.epoch}});
  Json statuses = counters_json(fleet.counters);
  // Statuses that the link refused never reach the table.
  add_counters(statuses, port_->link().side_report());
  return {{"excluded", excluded_},
          {"exclude_digest", exclude_digest_},
          {"exclude_differs", fleet.differ()},
          {"conflicts", std::move(conflicts)},
          {"floors_refused", sharing.floors_refused + state_->floors_refused()},
          {"statuses", std::move(statuses)}};
}

}  // namespace tessera
