// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "processes/member.hpp"

#include <algorithm>
#include <array>
#include <stdexcept>

#include "base/monotonic_clock.hpp"
#include "link/session.hpp"
#include "network/simulated_network.hpp"

namespace tessera::processes {

namespace {

template <class T>
T made(Result<T> result, const char* what) {
  if (!result.ok()) throw std::runtime_error(std::string(what) + ": " + to_string(result.status()));
  return std::move(*result);
}

template <class T>
T taken(Outcome<T> outcome) {
  if (!outcome.ok()) throw std::runtime_error(outcome.failure().text());
  return std::move(*outcome);
}

}  // namespace

Member::Member(const MemberConfig& config)
    : config_(config),
      keys_(taken(FleetKeys::read(config.keys, config.robot))),
      random_(config.seed + 1000003ULL * config.robot + config.session),
      epoch_(config.session) {
  ExchangeConfig exchange{.robot = config.robot, .session = taken(make_session(config.session))};
  exchange.mission = keys_->mission().number();
  if (config.map.empty()) {
    classes_ = oracle::numbered_classes(network::kClasses);
    exchange.resolution_m = config.resolution_m;
  } else {
    map_ = std::make_unique<network::MapBlocks>(config.map);
    const MapConfig& made_with = map_->map().config();
    classes_ = map_->map().classes();
    exchange.resolution_m = made_with.resolution_m;
    exchange.prior = made_with.prior;
    exchange.free_weight = made_with.free_weight;
  }
  exchange.records = config.parts;
  const int components = classes_.num_components();
  const std::uint32_t of_robot = config.robot_parts == 0 ? config.parts : config.robot_parts;
  const ReplicasConfig replicas{.segments = 4 * config.parts,
                                .blocks = config.parts,
                                .contributions = exchange.contributions,
                                .robot_segments = 4 * of_robot,
                                .robot_blocks = of_robot};
  memory_ = std::make_unique<AlignedMemory>(Replicas::required_bytes(replicas) +
                                            Exchange::required_bytes(exchange, components) +
                                            BlockContent::required_bytes(components));
  Arena arena(memory_->span());
  replicas_ = made(Replicas::make(arena, replicas), "replicas");
  const RobotKeys keys = keys_->keys();
  exchange_ = made(Exchange::make(arena, exchange, store_of(replicas_), keys.authenticator,
                                  classes_, keys.signatures),
                   "exchange");
  content_ = made(BlockContent::make(arena, components), "content");
  T_global_map_(0, 3) = config.robot;
  exchange_.set_floor(config.floor);
  if (exchange_.open(epoch_, 0, T_global_map_) != Status::kOk)
    throw std::runtime_error("no contribution can be opened");
  link_ = taken(DatagramLink::open(config.link));
  start_us_ = MonotonicClock::now_us();
  tick_us_ = start_us_;
}

int Member::blocks_in_all() const {
  return map_ ? std::min(config_.blocks, static_cast<int>(map_->size())) : config_.blocks;
}

/// Of a patch that the robot drives over: blocks are seen several times, then left behind.
BlockKey Member::random_block() {
  content_.clear();
  network::add_random_voxels(content_, random_, 10 + random_.below(60));
  const int x = published_ / 20 + random_.below(8);
  const int y = random_.below(8);
  return *pack({x, y, random_.below(2)});
}

bool Member::publish_next() {
  const BlockKey key =
      map_ ? map_->read(static_cast<std::size_t>(published_), content_) : random_block();
  const Result<std::uint32_t> bytes = exchange_.publish(key, content_);
  ++published_;
  if (bytes.ok()) published_bytes_ += *bytes;
  return bytes.ok();
}

void Member::publish_due(std::int64_t now_us) {
  const std::int64_t due = (now_us - start_us_) * config_.blocks_per_s / 1'000'000;
  const std::int64_t until = std::min<std::int64_t>(due, blocks_in_all());
  if (published_ >= until) return;
  while (published_ < until) {
    if (!publish_next()) throw std::runtime_error("no room for a block; give more --parts");
  }
  published_us_ = now_us;
}

void Member::leave_epoch(std::int64_t now_us) {
  const std::optional<std::uint32_t> overtaken = exchange_.overtaken();
  if (!overtaken || *overtaken == ~std::uint32_t{0}) return;
  epoch_ = *overtaken + 1;
  exchange_.set_floor(epoch_);
  if (exchange_.open(epoch_, 0, T_global_map_) != Status::kOk)
    throw std::runtime_error("no other epoch can be opened");
  // The same blocks again, all that were due until now at once.
  random_ = oracle::Random(config_.seed + 1000003ULL * config_.robot + config_.session);
  published_ = 0;
  publish_due(now_us);
}

void Member::hear() {
  std::array<std::byte, kMaxMessageBytes> bytes;
  for (;;) {
    const DatagramLink::Received received = link_->receive(bytes);
    if (received.bytes.empty()) return;
    exchange_.receive(received.bytes, MonotonicClock::now_us());
  }
}

void Member::say() {
  std::array<std::byte, kMostDatagramBytes> bytes;
  while (const std::size_t size = exchange_.send(MonotonicClock::now_us(), bytes))
    static_cast<void>(link_->send(std::span<const std::byte>(bytes).first(size)));
}

void Member::step() {
  link_->wait(tick_us_ + kTickUs - MonotonicClock::now_us());
  hear();
  const std::int64_t now_us = MonotonicClock::now_us();
  if (now_us < tick_us_ + kTickUs) return;
  tick_us_ = now_us;
  leave_epoch(now_us);
  publish_due(now_us);
  say();
  if (const std::uint64_t digest = exchange_.digest(); digest != digest_) {
    digest_ = digest;
    changed_us_ = now_us;
  }
}

void Member::leave() {
  exchange_.leave();
  say();
}

}  // namespace tessera::processes
