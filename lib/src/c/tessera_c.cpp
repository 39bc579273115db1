// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The C interface: making a robot, mapping, sharing.
#include "tessera_c.hpp"

#include <string_view>

#include "tessera/registration/point_labels.hpp"

using namespace tessera;
using namespace tessera::c_interface;

namespace {

/// Of a transform.
constexpr std::size_t kNumbers = 12;

bool all_or_none(bool first, bool second, bool third) noexcept {
  return first == second && second == third;
}

Status read_callbacks(const tessera_callbacks* from, tessera_callbacks& into) noexcept {
  if (from == nullptr) return Status::kOk;
  const Status status = read_struct(from, TESSERA_CALLBACKS_LEAST_BYTES, into);
  if (status != Status::kOk) return status;
  const bool whole =
      all_or_none(into.tag_message != nullptr, into.check_tag != nullptr,
                  into.tag_message != nullptr) &&
      all_or_none(into.sign != nullptr, into.check_signature != nullptr, into.hash != nullptr) &&
      all_or_none(into.put_block != nullptr, into.get_block != nullptr,
                  into.drop_block != nullptr) &&
      (into.put_block != nullptr) == (into.clear_blocks != nullptr);
  return whole ? Status::kOk : Status::kInvalidArgument;
}

/// Names end at the first zero, or with the 31st byte.
Status read_classes(const tessera_class* from, std::uint32_t count, ClassTable& into) noexcept {
  if (from == nullptr || count < 1 || count > TESSERA_MOST_CLASSES) return Status::kInvalidArgument;
  for (std::uint32_t i = 0; i < count; ++i) {
    std::size_t length = 0;
    while (length < sizeof(from[i].name) && from[i].name[length] != '\0') ++length;
    const std::string_view name(from[i].name, length);
    if (from[i].moves > 2) return Status::kInvalidArgument;
    const bool moves = from[i].moves == 0 ? moves_by_name(name) : from[i].moves == 1;
    const Status status = into.add(name, {from[i].red, from[i].green, from[i].blue}, moves);
    if (status != Status::kOk) return status;
  }
  return Status::kOk;
}

/// What the settings need of them.
bool is_there(const RobotConfig& config, const tessera_callbacks& callbacks) noexcept {
  return (config.deadline_us == 0 || callbacks.now_us != nullptr) &&
         (!config.window || callbacks.put_block != nullptr);
}

/// The archive of the mapper, if there is a window, and the cache.
Status make_archive(Arena& arena, const RobotConfig& config, tessera_robot& robot) noexcept {
  if (!config.window) return Status::kOk;
  const ClassTable& classes = robot.header.classes;
  const Result<StoredArchive*> archive = StoredArchive::make(
      arena, config.map, classes, config.archived_blocks, store_of(robot.callbacks));
  if (!archive.ok()) return archive.status();
  const std::span<LocalMap> cache = arena.take<LocalMap>(1);
  if (cache.empty()) return Status::kResourceExhausted;
  const Status made = LocalMap::make_at(
      cache.front(), arena, cache_config(config.map, classes.num_components()), classes);
  if (made != Status::kOk) return made;
  robot.archive = *archive;
  robot.cache = cache.data();
  robot.robot->mapper().set_archive(robot.archive->interface());
  return Status::kOk;
}

}  // namespace

extern "C" {

tessera_status tessera_robot_make(const tessera_config* config, const tessera_class* classes,
                                  uint32_t num_classes, const tessera_callbacks* callbacks,
                                  void* memory, uint64_t bytes, tessera_robot** robot) {
  if (memory == nullptr || robot == nullptr ||
      reinterpret_cast<std::uintptr_t>(memory) % TESSERA_ALIGNMENT != 0)
    return TESSERA_INVALID_ARGUMENT;
  RobotConfig core;
  Status status = read_config(config, core);
  if (status != Status::kOk) return status_of(status);
  Arena arena({static_cast<std::byte*>(memory), size_of(bytes)});
  const std::span<tessera_robot> place = arena.take<tessera_robot>(1);
  if (place.empty()) return TESSERA_RESOURCE_EXHAUSTED;
  tessera_robot& made = place.front();
  // On its way to the maps it is no more on the stack than it must be.
  ClassTable& table = made.header.classes;
  status = read_classes(classes, num_classes, table);
  if (status == Status::kOk) status = read_kernels(config, table);
  if (status == Status::kOk) status = read_callbacks(callbacks, made.callbacks);
  if (status == Status::kOk && !is_there(core, made.callbacks)) status = Status::kInvalidArgument;
  if (status != Status::kOk) return status_of(status);

  const Result<Robot*> inner =
      Robot::make(arena, core, table, keys_of(made.callbacks), clock_of(made.callbacks));
  if (!inner.ok()) return status_of(inner.status());
  made.workspace = arena.take<std::uint64_t>(workspace_words(table.num_components()));
  if (made.workspace.empty()) return TESSERA_RESOURCE_EXHAUSTED;
  made.robot = *inner;
  status = make_archive(arena, core, made);
  if (status != Status::kOk) return status_of(status);
  made.magic = tessera_robot::kMagic;
  *robot = &made;
  return TESSERA_OK;
}

tessera_status tessera_used_bytes(const tessera_robot* robot, uint64_t* bytes) {
  if (!is_robot(robot) || bytes == nullptr) return TESSERA_INVALID_ARGUMENT;
  *bytes = robot->robot->used_bytes() + sizeof(tessera_robot);
  return TESSERA_OK;
}

tessera_status tessera_label_weights(const float* probabilities, uint32_t labels,
                                     uint8_t* weights) {
  if (labels > kMostLabels || (labels > 0 && (probabilities == nullptr || weights == nullptr)))
    return TESSERA_INVALID_ARGUMENT;
  return status_of(quantise_label_weights({probabilities, labels}, {weights, labels}));
}

tessera_status tessera_integrate(tessera_robot* robot, const tessera_scan* scan,
                                 tessera_scan_report* report) {
  if (!is_robot(robot) || (report != nullptr && !can_fill(report))) return TESSERA_INVALID_ARGUMENT;
  tessera_scan given{};
  if (const Status status = read_struct(scan, TESSERA_SCAN_LEAST_BYTES, given);
      status != Status::kOk)
    return status_of(status);
  const bool points = given.stride_floats >= 3 && (given.count == 0 || given.points != nullptr) &&
                      given.count <= UINT32_MAX;
  const std::uint32_t labels = given.labels_per_point == 0 ? 1 : given.labels_per_point;
  const bool labelled = labels <= kMostLabels && (labels == 1 || given.label_weights != nullptr) &&
                        (given.label_weights == nullptr || given.components != nullptr) &&
                        given.reserved == 0;
  if (!points || !labelled || !is_time(given.now_us) || !is_time(given.due_us) ||
      (given.due_us != 0 && robot->callbacks.now_us == nullptr))
    return TESSERA_INVALID_ARGUMENT;
  const ScanView view{.T_map_sensor = matrix_of(given.T_map_sensor),
                      .points = given.points,
                      .stride_floats = given.stride_floats,
                      .count = size_of(given.count),
                      .components = given.components,
                      .weights = given.weights,
                      .T_body_sensor = matrix_or_identity(given.T_body_sensor),
                      .no_return = given.no_return,
                      .labels_per_point = labels,
                      .label_weights = given.label_weights};
  Robot& core = *robot->robot;
  const ScanReport from = given.due_us == 0
                              ? core.integrate(view, given.now_us)
                              : core.integrate_until(view, given.due_us, given.now_us);
  if (report == nullptr) return TESSERA_OK;
  tessera_scan_report filled{};
  filled.pose = static_cast<std::uint32_t>(from.pose);
  TESSERA_SCAN_COUNTERS(TESSERA_FILL)
  fill(filled, report);
  return TESSERA_OK;
}

tessera_status tessera_set_work_budget(tessera_robot* robot, uint64_t work) {
  if (!is_robot(robot)) return TESSERA_INVALID_ARGUMENT;
  robot->robot->mapper().set_work_budget(work);
  return TESSERA_OK;
}

tessera_status tessera_receive(tessera_robot* robot, const void* datagram, size_t bytes,
                               int64_t now_us) {
  if (!is_robot(robot) || datagram == nullptr || !is_time(now_us)) return TESSERA_INVALID_ARGUMENT;
  robot->robot->receive({static_cast<const std::byte*>(datagram), bytes}, now_us);
  return TESSERA_OK;
}

tessera_status tessera_tick(tessera_robot* robot, int64_t now_us, tessera_tick_report* report) {
  if (!is_robot(robot) || !is_time(now_us) || (report != nullptr && !can_fill(report)))
    return TESSERA_INVALID_ARGUMENT;
  const PublisherReport from = robot->robot->tick(now_us);
  if (report == nullptr) return TESSERA_OK;
  tessera_tick_report filled{};
  TESSERA_PUBLISHER_COUNTERS(TESSERA_FILL)
  fill(filled, report);
  return TESSERA_OK;
}

tessera_status tessera_send(tessera_robot* robot, int64_t now_us, void* into, size_t capacity,
                            size_t* bytes) {
  if (!is_robot(robot) || into == nullptr || bytes == nullptr || !is_time(now_us) ||
      capacity < TESSERA_MOST_DATAGRAM_BYTES)
    return TESSERA_INVALID_ARGUMENT;
  *bytes = robot->robot->send(now_us, {static_cast<std::byte*>(into), capacity});
  return TESSERA_OK;
}

tessera_status tessera_fuse(tessera_robot* robot, uint64_t work, uint64_t* done) {
  if (!is_robot(robot)) return TESSERA_INVALID_ARGUMENT;
  const std::uint64_t spent = robot->robot->sharer().fuse(work);
  if (done != nullptr) *done = spent;
  return TESSERA_OK;
}

tessera_status tessera_is_idle(const tessera_robot* robot, uint32_t* idle) {
  if (!is_robot(robot) || idle == nullptr) return TESSERA_INVALID_ARGUMENT;
  *idle = robot->robot->idle() ? 1U : 0U;
  return TESSERA_OK;
}

tessera_status tessera_leave(tessera_robot* robot) {
  if (!is_robot(robot)) return TESSERA_INVALID_ARGUMENT;
  robot->robot->exchange().leave();
  return TESSERA_OK;
}

tessera_status tessera_exclude(tessera_robot* robot, uint32_t excluded) {
  if (!is_robot(robot)) return TESSERA_INVALID_ARGUMENT;
  return status_of(robot->robot->exchange().exclude(excluded));
}

tessera_status tessera_new_submap(tessera_robot* robot, const double* T_global_map) {
  if (!is_robot(robot) || T_global_map == nullptr) return TESSERA_INVALID_ARGUMENT;
  return status_of(robot->robot->new_submap(matrix_of(T_global_map)));
}

tessera_status tessera_set_frame(tessera_robot* robot, uint32_t submap,
                                 const double* T_global_map) {
  if (!is_robot(robot) || T_global_map == nullptr) return TESSERA_INVALID_ARGUMENT;
  return status_of(robot->robot->set_frame(submap, matrix_of(T_global_map)));
}

tessera_status tessera_set_route(tessera_robot* robot, uint32_t count, const double* p_global) {
  if (!is_robot(robot) || (count != 0 && p_global == nullptr)) return TESSERA_INVALID_ARGUMENT;
  std::array<Point3d, Sharer::kMostRoute> places;
  const std::size_t used = std::min(size_of(count), places.size());
  for (std::size_t i = 0; i < used; ++i) {
    places[i] = Point3d(p_global[3 * i], p_global[3 * i + 1], p_global[3 * i + 2]);
    if (!places[i].allFinite()) return TESSERA_INVALID_ARGUMENT;
  }
  robot->robot->set_route(std::span(places).first(used));
  return TESSERA_OK;
}

tessera_status tessera_correct(tessera_robot* robot, uint32_t revision, uint32_t count,
                               const int64_t* stamps_us, const double* T_world_sensor) {
  if (!is_robot(robot) || count == 0 || stamps_us == nullptr || T_world_sensor == nullptr)
    return TESSERA_INVALID_ARGUMENT;
  const CorrectedTrajectory trajectory{
      .stamps_us = {stamps_us, count},
      .T_world_sensor = {T_world_sensor, kNumbers * size_of(count)}};
  return status_of(robot->robot->correct(trajectory, revision).status);
}

tessera_status tessera_correct_frames(tessera_robot* robot, uint32_t revision, uint32_t count,
                                      const uint32_t* submaps, const double* T_world_map) {
  if (!is_robot(robot) || count == 0 || submaps == nullptr || T_world_map == nullptr)
    return TESSERA_INVALID_ARGUMENT;
  const CorrectedFrames frames{.submaps = {submaps, count},
                               .T_world_map = {T_world_map, kNumbers * size_of(count)}};
  return status_of(robot->robot->correct(frames, revision).status);
}

}  // extern "C"
