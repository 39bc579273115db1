// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "network/simulated_network.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "network/held.hpp"
#include "tessera/exchange/internal/block_codec.hpp"

namespace tessera::network {

namespace {

template <class T>
T made(Result<T> result) {
  if (!result.ok()) throw std::runtime_error(to_string(result.status()));
  return std::move(*result);
}

ExchangeConfig with_records(ExchangeConfig config, const ReplicasConfig& replicas) {
  config.records = replicas.blocks;
  return config;
}

}  // namespace

void add_random_voxels(BlockContent& content, oracle::Random& random, int voxels) {
  for (int i = 0; i < voxels; ++i) {
    // One draw a statement: arguments are evaluated in any order.
    const int row = random.below(kBlockVoxels);
    const int label = 1 + random.below(kClasses);
    content.add(label, row, static_cast<float>(random.uniform(0.1, 50.0)));
    if (random.below(4) != 0) continue;
    const int free_row = random.below(kBlockVoxels);
    content.add_passes(free_row, static_cast<unsigned>(random.below(250) + 1));
  }
  quantise(content);
}

Robot::Robot(std::uint32_t number, std::uint32_t session, const ReplicasConfig& replicas,
             const ExchangeConfig& config, const RobotOptions& options)
    : session_(session),
      key_(options.key.value_or(0)),
      components_(options.classes + 2),
      memory_(Replicas::required_bytes(replicas) +
              Exchange::required_bytes(with_records(config, replicas), components_) +
              BlockContent::required_bytes(components_)) {
  Arena arena(memory_.span());
  replicas_ = made(Replicas::make(arena, replicas));
  ExchangeConfig own = with_records(config, replicas);
  own.robot = number;
  own.session = std::uint64_t{session} << 32U | options.random_bits;
  exchange_ = made(Exchange::make(arena, own, store_of(replicas_), options.authenticator,
                                  oracle::numbered_classes(options.classes),
                                  options.key ? key_.signatures() : options.signatures));
  content_ = made(BlockContent::make(arena, components_));
  Matrix34d T_global_map = Matrix34d::Identity();
  T_global_map(0, 3) = number;
  if (options.floor != 0) exchange_.set_floor(options.floor);
  if (exchange_.open(session, 0, T_global_map) != Status::kOk) throw std::runtime_error("open");
}

Result<std::uint32_t> Robot::publish(BlockKey key, oracle::Random& random, int voxels) {
  content_.clear();
  add_random_voxels(content_, random, voxels);
  return exchange_.publish(key, content_);
}

std::uint64_t Robot::content_digest() const {
  return network::content_digest(replicas_, components_);
}

std::vector<std::vector<std::byte>> said(Robot& robot, std::int64_t from_us, std::int64_t for_us) {
  std::vector<std::vector<std::byte>> all;
  std::vector<std::byte> datagram(kMostDatagramBytes);
  for (std::int64_t now_us = from_us; now_us < from_us + for_us; now_us += kTickUs) {
    while (const std::size_t size = robot.exchange().send(now_us, datagram))
      all.emplace_back(datagram.begin(), datagram.begin() + static_cast<std::ptrdiff_t>(size));
  }
  return all;
}

DatagramKind kind_of(std::span<const std::byte> datagram) {
  ByteReader from(datagram);
  DatagramHeader header;
  if (!read_header(from, header)) throw std::logic_error("a robot said what is no datagram");
  return header.kind;
}

void talk(const std::vector<Robot*>& robots, std::int64_t& now_us, std::int64_t for_us,
          const IsLost& is_lost) {
  for (const std::int64_t until_us = now_us + for_us; now_us < until_us; now_us += kTickUs) {
    for (Robot* const from : robots) {
      for (const auto& datagram : said(*from, now_us, kTickUs)) {
        for (Robot* const to : robots) {
          if (to != from && !(is_lost && is_lost(*to, datagram)))
            to->exchange().receive(datagram, now_us);
        }
      }
    }
  }
}

ReplicasConfig Network::default_replicas() {
  return {
      .segments = 1U << 16U, .blocks = 1U << 14U, .contributions = 16, .robot_segments = 1U << 16U};
}

Network::Network(int robots, const Link& link, std::uint64_t seed, ReplicasConfig replicas,
                 ExchangeConfig config, bool with_signatures, int classes)
    : random_(seed),
      replicas_(replicas),
      config_(config),
      with_signatures_(with_signatures),
      classes_(classes) {
  config_.contributions = replicas.contributions;
  sessions_.assign(static_cast<std::size_t>(robots), 1);
  for (std::size_t i = 0; i < sessions_.size(); ++i) robots_.push_back(new_robot(i));
  set_link(link);
}

std::unique_ptr<Robot> Network::new_robot(std::size_t i, std::uint32_t floor) const {
  const auto number = static_cast<std::uint32_t>(i);
  RobotOptions options;
  options.classes = classes_;
  options.random_bits = 1000 * number + processes_;
  options.floor = floor;
  if (with_signatures_) options.key = number;
  return std::make_unique<Robot>(number, sessions_[i], replicas_, config_, options);
}

void Network::set_link(const Link& link) {
  links_.assign(robots_.size() * robots_.size(), link);
  bursts_.assign(links_.size(), 0);
}

void Network::set_link(int from, int to, const Link& link) {
  links_[static_cast<std::size_t>(from * size() + to)] = link;
}

void Network::restart(int i) { restart(i, 0); }

void Network::restart(int i, std::uint32_t floor) {
  const auto at = static_cast<std::size_t>(i);
  sent_before_ += robots_[at]->exchange().report().sent_bytes;
  ++sessions_[at];
  ++processes_;
  robots_[at] = new_robot(at, floor);
}

void Network::restart_without_counter(int i) {
  sessions_[static_cast<std::size_t>(i)] = 0;
  restart(i);
}

bool Network::hears(int from, int to) const {
  if (from == to || off_.count(from) != 0 || off_.count(to) != 0) return false;
  return groups_.empty() ||
         groups_[static_cast<std::size_t>(from)] == groups_[static_cast<std::size_t>(to)];
}

void Network::deliver(int from, int to,
                      const std::shared_ptr<const std::vector<std::byte>>& bytes) {
  if (!hears(from, to)) return;
  const auto number = static_cast<std::size_t>(from * size() + to);
  const Link& link = links_[number];
  int& burst = bursts_[number];
  if (burst == 0 && link.burst > 0.0 && random_.uniform() < link.burst) burst = link.burst_length;
  const bool lost = burst > 0 || random_.uniform() < link.loss;
  burst -= burst > 0 ? 1 : 0;
  if (lost) return;
  const int copies = random_.uniform() < link.duplicate ? 2 : 1;
  for (int copy = 0; copy < copies; ++copy) {
    std::shared_ptr<const std::vector<std::byte>> arriving = bytes;
    if (random_.uniform() < link.corrupt) {
      std::vector<std::byte> damaged = *bytes;
      if (random_.below(4) == 0) {
        damaged.resize(static_cast<std::size_t>(random_.below(1500)));
      } else {
        const auto at = static_cast<std::size_t>(random_.below(static_cast<int>(damaged.size())));
        damaged[at] ^= static_cast<std::byte>(1 + random_.below(255));
      }
      arriving = std::make_shared<const std::vector<std::byte>>(std::move(damaged));
    }
    const std::int64_t delay = link.delay_us + random_.below(static_cast<int>(link.jitter_us) + 1);
    on_their_way_.push({now_us_ + delay, order_++, to, std::move(arriving)});
  }
}

void Network::send_from(int i) {
  std::vector<std::byte> datagram(kMostDatagramBytes);
  Exchange& exchange = robot(i).exchange();
  while (const std::size_t size = exchange.send(clock_us(i, now_us_), datagram)) {
    const auto bytes = std::make_shared<const std::vector<std::byte>>(
        datagram.begin(), datagram.begin() + static_cast<std::ptrdiff_t>(size));
    for (int to = 0; to < this->size(); ++to) deliver(i, to, bytes);
  }
}

void Network::tick() {
  while (!on_their_way_.empty() && on_their_way_.top().at_us <= now_us_) {
    const Arrival arrival = on_their_way_.top();
    on_their_way_.pop();
    if (off_.count(arrival.to) == 0)
      robot(arrival.to).exchange().receive(*arrival.bytes, clock_us(arrival.to, arrival.at_us));
  }
  for (int i = 0; i < size(); ++i) {
    if (off_.count(i) == 0) send_from(i);
  }
  now_us_ += kTickUs;
}

void Network::run(std::int64_t duration_us) {
  for (const std::int64_t end = now_us_ + duration_us; now_us_ < end;) tick();
}

bool Network::agree() const {
  std::set<std::uint64_t> digests;
  std::set<std::uint64_t> contents;
  for (int i = 0; i < size(); ++i) {
    if (off_.count(i) != 0) continue;
    digests.insert(robots_[static_cast<std::size_t>(i)]->exchange().digest());
  }
  if (digests.size() > 1) return false;
  for (int i = 0; i < size(); ++i) {
    if (off_.count(i) == 0) contents.insert(robots_[static_cast<std::size_t>(i)]->content_digest());
  }
  return contents.size() <= 1;
}

bool Network::settle(std::int64_t most_us) {
  const std::int64_t end = now_us_ + most_us;
  while (now_us_ < end) {
    run(10 * kTickUs);
    if (agree()) return true;
  }
  return false;
}

std::uint64_t Network::sent_bytes() const {
  std::uint64_t sum = sent_before_;
  for (const auto& robot : robots_) sum += robot->exchange().report().sent_bytes;
  return sum;
}

}  // namespace tessera::network
