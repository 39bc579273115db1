// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "soak/member.hpp"

#include <unistd.h>

#include <algorithm>
#include <filesystem>

namespace tessera::soak {

namespace {

constexpr std::int64_t kListen_us = 1'200'000;  // As a node.

}  // namespace

void add(Counts& to, const Counts& more) {
  for (const auto& [name, count] : more) to[name] += count;
}

template <class Call>
auto Member::counted(Call&& call) {
  struct Counter {
    explicit Counter(std::uint64_t& sum) : to(sum), before(thread_heap_allocations().value_or(0)) {}
    ~Counter() { to += thread_heap_allocations().value_or(0) - before; }
    Counter(const Counter&) = delete;
    Counter& operator=(const Counter&) = delete;
    std::uint64_t& to;
    std::uint64_t before;
  };
  const Counter counter(allocations_);
  return call();
}

MapName Member::map_name() const { return {config_.node.state, number(), state_->map_epoch()}; }

MapIdentity Member::identity() const {
  MapIdentity identity;
  identity.robot = number();
  identity.epoch = state_->map_epoch();
  identity.has_T_global_map = true;
  identity.T_global_map = matrix_of(config_.T_global_map);
  return identity;
}

/// Files of the map before: it is given up.
void Member::remove_files() const {
  const std::string begin = "robot_" + std::to_string(number()) + ".epoch-";
  std::error_code error;
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(config_.node.state, error)) {
    if (entry.path().filename().string().starts_with(begin)) files.push_back(entry.path());
  }
  for (const std::filesystem::path& file : files) ::unlink(file.c_str());
}

/// The order is that of Node::set_up.
Outcome<void> Member::start(bool continues) {
  TESSERA_TRY_ASSIGN(lock_, lock_robot(config_.node.state, number()));
  TESSERA_TRY_ASSIGN(RobotState state, RobotState::open(config_.node.state, number()));
  state_.emplace(std::move(state));
  std::optional<FoundMap> found;
  if (continues && state_->map_epoch() != 0) {
    TESSERA_TRY_ASSIGN(found, find_map(map_name()));
  }
  if (!continues) remove_files();
  TESSERA_TRY(
      state_->begin(config_.node.earlier, found ? StartMap::kSubmaps : StartMap::kEmptySubmaps));
  TESSERA_TRY(make_robot_of(found));
  TESSERA_TRY_ASSIGN(kept_, KeptSubmaps::make(map_name().stem(), robot().map()));
  kept_->take_up(found ? found->state.kept : std::vector<SubmapRow>(), state_->map_epoch());
  robot().mapper().maps().require(LocalMaps::User::kKeeping);
  for (const RobotFloor& heard : state_->floors())
    robot().exchange().set_floor_of(heard.robot, heard.floor);
  if (!found) {
    TESSERA_TRY_ASSIGN(durable_, DurableMap::begin(map_name(), robot(), identity()));
  } else {
    if (!found->state.kept.empty())
      earlier_ = std::make_unique<EarlierSubmaps>(map_name().stem(), found->state.kept);
    TESSERA_TRY_ASSIGN(durable_, DurableMap::resume(*found, robot(), identity(), true));
    notes_.insert(notes_.end(), found->notes.begin(), found->notes.end());
    if (durable_->damaged_bytes() != 0) notes_.push_back("a journal was damaged");
    if (durable_->left_out_blocks() != 0) notes_.push_back("a journal had blocks of no map");
  }
  mapping_ = {};
  mapping_.submap = robot().maps().number();
  scans_ = {};
  allocations_ = 0;
  keep_due_us_ = 0;
  return {};
}

Outcome<void> Member::make_robot_of(std::optional<FoundMap>& found) {
  TESSERA_TRY_ASSIGN(
      RobotSetup setup,
      set_up_robot(
          config_.node,
          {.max_points = std::size_t{Scanner::kBeams} * Scanner::kDirections, .classes = classes_},
          state_->epoch()));
  RobotConfig& robot = setup.robot;
  if (found) {
    robot.first_submap = found->first();
    robot.submaps_before = robot.first_submap - found->state.first;
  }
  robot.T_global_map = matrix_of(config_.T_global_map);
  robot.epoch = state_->epoch();
  robot.floor = state_->floor();
  const std::uint64_t random =
      street::hash_of(config_.seed, street::Stream::kDrive, number(), state_->starts());
  robot.exchange.session = std::uint64_t{state_->starts()} << 32U | (random & 0xffff'ffffU);
  robot.global.map.hash_seed = street::mix(random);
  robot.exchange.listen_us = kListen_us;
  const Clock clock{nullptr, [](void*) { return std::int64_t{0}; }};  // There are no deadlines.
  TESSERA_TRY_ASSIGN(HeldRobot made, make_robot(robot, setup.classes, {}, clock));
  robot_.emplace(std::move(made));
  return {};
}

void Member::kill() {
  add(limits_before_, limits_now());
  add(events_before_, events_now());
  earlier_.reset();
  durable_.reset();
  kept_.reset();
  robot_.reset();
  state_.reset();
  lock_ = {};
}

void Member::receive(std::span<const std::byte> datagram, std::int64_t now_us) {
  counted([&] {
    robot().receive(datagram, now_us);
    robot().fuse();
  });
}

ScanReport Member::integrate(ScanView scan, const FlatPose& T_map_sensor, std::int64_t now_us) {
  scan.T_map_sensor = matrix_of(T_map_sensor);
  const ScanReport report = counted([&] { return robot().integrate(scan, now_us); });
  scans_.add(report);
  if (report.pose != Status::kOk) return report;
  ++mapping_.cycles;
  mapping_.submap = robot().maps().number();
  mapping_.submap_note = robot().mapper().submap_note();
  mapping_.map_revision = robot().map().revision();
  mapping_.stamp_us = now_us;
  std::copy_n(scan.T_map_sensor.data(), mapping_.T_map_body.size(), mapping_.T_map_body.begin());
  return report;
}

void Member::tick(std::int64_t now_us) {
  counted([&] { static_cast<void>(robot().tick(now_us)); });
  if (earlier_) earlier_->tick(robot().sharer(), now_us, robot().exchange().report().records_taken);
}

std::span<const std::byte> Member::send(std::int64_t now_us) {
  const std::size_t bytes = counted([&] { return robot().send(now_us, datagram_); });
  return std::span(datagram_).first(bytes);
}

Outcome<void> Member::keep_ended() {
  if (!robot().maps().ended(LocalMaps::User::kKeeping)) return {};
  return kept_->keep_ended(robot().mapper().maps(), identity());
}

Outcome<void> Member::keep(std::int64_t now_us) {
  if (mapping_.cycles == 0) return {};
  if (now_us < keep_due_us_ && !durable_->is_behind(mapping_)) return {};
  keep_due_us_ = now_us + kKeep_us;
  frames_->take(robot().sharer().frames());
  TESSERA_TRY(durable_->keep(mapping_, frames_.get(), kept_.get(), now_us));
  if (earlier_) TESSERA_TRY(earlier_->look());
  TESSERA_TRY(keep_state());
  return leave_epoch();
}

Outcome<void> Member::keep_state() {
  if (robot().exchange().report().published_parts != 0 && state_->published() < state_->epoch())
    TESSERA_TRY(state_->note_published(state_->epoch()));
  return state_->note_floors(robot().exchange().epochs().all());
}

/// Never, as nobody else has this robot's number: an event that is counted, and then done as a node
/// does it.
Outcome<void> Member::leave_epoch() {
  const std::optional<std::uint32_t> overtaken = robot().exchange().overtaken();
  if (!overtaken) return {};
  const bool was_mixed = *overtaken == state_->epoch();
  TESSERA_TRY(state_->raise_epoch(std::uint64_t{*overtaken} + 1));
  const std::uint32_t floor = was_mixed ? state_->epoch() : state_->floor();
  if (robot().sharer().reopen(state_->epoch(), floor) != Status::kOk)
    return Failure{"the epoch cannot be left", FailureKind::kFailure};
  return {};
}

CorrectionReport Member::correct(const CorrectedTrajectory& trajectory) {
  const std::uint32_t revision = robot().sharer().frames().revision() + 1;
  return counted([&] { return robot().correct(trajectory, revision); });
}

CorrectionReport Member::correct(const CorrectedFrames& frames) {
  const std::uint32_t revision = robot().sharer().frames().revision() + 1;
  return counted([&] { return robot().correct(frames, revision); });
}

std::uint32_t Member::submaps() const {
  const SubmapFrames& frames = robot().sharer().frames();
  return frames.last() - frames.first() + 1;
}

std::optional<std::uint64_t> Member::allocations() const {
  return thread_heap_allocations() ? std::optional(allocations_) : std::nullopt;
}

Counts Member::limits_now() const {
  if (!robot_) return {};
  const ExchangeReport exchange = robot().exchange().report();
  const GlobalMapReport global = robot().global().counters();
  const ReplicasUsage replicas = robot().global().replicas().usage();
  const SubmapReport& submap = robot().sharer().submap();
  const SubmapCounts& submaps = robot().mapper().submaps();
  return {{"points without room in the local map", scans_.refused_storage},
          {"scans beyond the last submap's length", submaps.late},
          {"scans left out", submaps.left_out},
          {"contributions refused", exchange.refused_contributions},
          {"contributions displaced", exchange.displaced_contributions},
          {"records refused", exchange.records_refused},
          {"parts not published", exchange.refused_parts},
          {"replicas without storage", replicas.replicas_refused_storage},
          {"replicas beyond a robot's share", replicas.replicas_refused_quota},
          {"global blocks refused", global.refused_blocks},
          {"global sums refused", global.refused_sums},
          {"global outputs refused", global.refused_outputs},
          {"blocks shown early in a move", global.torn_blocks},
          {"blocks of ended submaps not published", submap.lost_blocks},
          {"submaps cut short", submap.cut_short},
          {"frames out of the grid", submap.refused_frames},
          {"corrections refused", submap.refused_corrections},
          {"blocks left out by the publisher", robot().publisher().totals().left_out}};
}

Counts Member::events_now() const {
  if (!robot_) return {};
  const ExchangeReport exchange = robot().exchange().report();
  const SubmapCounts& submaps = robot().mapper().submaps();
  return {{"submaps begun", submaps.by_length + submaps.by_jump + submaps.by_request},
          {"scans", mapping_.cycles},
          {"records taken", exchange.records_taken},
          {"contributions ended by a floor", exchange.ended_contributions},
          {"comparisons", exchange.diverged},
          {"submaps published again", earlier_ ? earlier_->published() : 0U},
          {"epochs left", robot().sharer().submap().reopened},
          {"impostors", exchange.impostors + exchange.twins + exchange.conflicts},
          {"bytes written to journals", durable_->written_bytes()}};
}

Counts Member::limits() const {
  Counts all = limits_before_;
  add(all, limits_now());
  return all;
}

Counts Member::events() const {
  Counts all = events_before_;
  add(all, events_now());
  return all;
}

std::uint64_t Member::file_bytes() const { return kept_->bytes() + durable_->file_bytes(); }

Json Member::state() const { return {{"limits", limits()}, {"events", events()}}; }

void Member::restore(const Json& state) {
  limits_before_ = state.at("limits").get<Counts>();
  events_before_ = state.at("events").get<Counts>();
}

}  // namespace tessera::soak
