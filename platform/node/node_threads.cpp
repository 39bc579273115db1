// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Makes the threads of a node, and starts and ends them in order.
#include <algorithm>

#include "base/monotonic_clock.hpp"
#include "node/node.hpp"
#include "node/thread_roles.hpp"

namespace tessera {

namespace {

VehiclePortConfig vehicle_config(const NodeConfig& config) {
  VehiclePortConfig port;
  port.socket.interface = config.vehicle.can;
  port.inputs.base_id = config.vehicle.base_id;
  port.inputs.guard = config.vehicle.guard;
  port.inputs.mode = config.vehicle.mode;
  port.can_fd = config.vehicle.can_fd;
  port.thread = thread_roles(config).vehicle;
  return port;
}

}  // namespace

ScanSource& Node::source() const {
  if (sensing_) return *sensing_;
  return *replay_;
}

Outcome<void> Node::make_threads() {
  if (!config_.vehicle.can.empty()) {
    TESSERA_TRY_ASSIGN(std::unique_ptr<VehiclePort> opened,
                       VehiclePort::open(vehicle_config(config_)));
    vehicle_port_ = std::move(opened);
  }
  TESSERA_TRY(make_sensing());
  mapping_ = std::make_unique<MappingThread>(robot_->mapper(), source(), mapping_wake_,
                                             MappingConfig{.period_us = 1000 * config_.period_ms,
                                                           .has_body = config_.sensors.enabled,
                                                           .may_wait = tessera::may_wait(config_)},
                                             *registrar_);
  const EachTick each_tick{
      this, [](void* self, std::int64_t now_us) { static_cast<Node*>(self)->after_tick(now_us); }};
  sharing_ = std::make_unique<SharingThread>(robot_->sharer(), robot_->mapper().maps(), *mapping_,
                                             *port_, 1000 * config_.tick_ms, each_tick);
  mapping_->follow(sharing_->teammates(), sharing_->watched());
  if (sensing_) sharing_->follow(sensing_->state());
  return make_services();
}

Outcome<void> Node::make_services() {
  if (!config_.view.empty()) {
    TESSERA_TRY_ASSIGN(const ListenAddress address, parse_listen_address(config_.view));
    TESSERA_TRY_ASSIGN(
        std::unique_ptr<ViewThread> view,
        ViewThread::open({.address = address, .voxels_per_s = config_.view_voxels_per_s},
                         {.robot = config_.robot,
                          .T_global_map = setup_.robot.T_global_map,
                          .period_us = 1000 * config_.period_ms,
                          .local = &robot_->maps(),
                          .global = &robot_->global(),
                          .mapping = mapping_.get(),
                          .sharing = sharing_.get(),
                          .port = port_.get(),
                          .fleet = &*fleet_,
                          .doubts = &doubts_,
                          .frames = &frames_}));
    view_ = std::move(view);
  }
  if (!config_.queries) return {};
  TESSERA_TRY_ASSIGN(
      std::unique_ptr<QueryThread> queries,
      QueryThread::open({.url = config_.query_url,
                         .interface = config_.query_interface,
                         .limits = {.requests_per_s = static_cast<int>(config_.queries_per_s)},
                         .thread = thread_roles(config_).query_link},
                        {.local = MapReader(robot_->maps()), .global = &robot_->global()}));
  queries_ = std::move(queries);
  sharing_->follow(queries_->asked());
  return {};
}

Outcome<void> Node::make_vehicle(NodeRequests& requests) {
  if (!vehicle_port_) return {};
  VehicleThreadConfig config;
  config.sectors = sectors_of(config_.vehicle);
  config.robot = config_.robot;
  config.period_us = 1000 * config_.period_ms;
  TESSERA_TRY_ASSIGN(
      std::unique_ptr<VehicleThread> made,
      VehicleThread::make(config, robot_->maps(), *vehicle_port_, *mapping_, *sharing_,
                          sensing_.get(), {requests.save, saves_, failed_saves_}));
  vehicle_ = std::move(made);
  return {};
}

Outcome<void> Node::start_threads() {
  const ThreadRoles roles = thread_roles(config_);
  run_.start_us = MonotonicClock::now_us();
  status_due_us_ = snapshot_due_us_ = run_.start_us;
  Outcome<void> started = sharing_->start(roles.sharing, run_.start_us);
  if (started.ok()) started = mapping_->start(roles.mapping);
  if (started.ok() && queries_) started = queries_->start(roles.query);
  if (started.ok() && view_) started = view_->start(roles.view);
  if (started.ok() && vehicle_) started = vehicle_->start(roles.sending);
  if (started.ok() && sensing_) started = sensing_->start(roles.sensing, *mapping_, mapping_wake_);
  if (started.ok() && replay_) started = replay_->start(roles.replay, run_.start_us);
  if (!started.ok()) return started;
  // Last, as threads inherit the processors.
  const bool kept = keep_to_cpus(roles.first.cpus);
  run_.missing = missing_rights(roles);
  run_.missing.cpus = run_.missing.cpus || !kept;
  return {};
}

/// The sources of a thread end before it.
void Node::stop_threads() noexcept {
  if (replay_) replay_->stop();
  if (sensing_) sensing_->stop();
  if (queries_) queries_->stop();
  if (view_) view_->stop();
  if (mapping_) mapping_->stop();
  if (vehicle_) vehicle_->say_stopping();
  if (sharing_) sharing_->stop();
  if (port_) port_->close();
  has_stopped_ = true;
}

}  // namespace tessera
