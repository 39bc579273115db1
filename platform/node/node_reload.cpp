// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a node takes of its configuration while it runs: who is excluded, and the public keys.
#include <algorithm>
#include <array>

#include "node/node.hpp"
#include "posix/allocation_counter.hpp"
#include "posix/monotonic_clock.hpp"

namespace tessera {

namespace {

/// "[map] resolution_m, [run] tick_ms": keys other than exclude whose values differ.
std::string changed_keys(const Json& before, const Json& after) {
  std::string keys;
  for (const auto& [table, values] : after.items()) {
    for (const auto& [name, value] : values.items()) {
      const std::string key = "[" + table + "] " + name;
      const Json& old = before.contains(table) ? before.at(table) : Json::object();
      if (key == "[security] exclude" || (old.contains(name) && old.at(name) == value)) continue;
      keys += (keys.empty() ? "" : ", ") + key;
    }
  }
  return keys;
}

}  // namespace

Outcome<void> Node::read_again() {
  const Outcome<NodeConfig> next = read_node_config(path_);
  if (!next.ok()) return next.failure();
  Outcome<FleetKeys> keys = FleetKeys::read(config_.keys, config_.robot);
  if (!keys.ok()) return keys.failure();
  excluded_ = next->exclude;
  ignored_keys_ = changed_keys(config_.values, next->values);
  updates_.offer(std::make_unique<SecurityUpdate>(SecurityUpdate{next->exclude, std::move(*keys)}));
  return {};
}

/// The writer of the log is this thread: texts stay until it has written them.
void Node::reload() {
  const std::uint64_t before = thread_heap_allocations().value_or(0);
  const std::int64_t now_us = MonotonicClock::now_us();
  const Outcome<void> read = read_again();
  if (!read.ok()) {
    reload_failure_ = "nothing is read again: " + read.failure().message;
    log_.say_change(LogLevel::kError, now_us, reload_failure_.c_str());
  } else {
    log_.say_change(LogLevel::kInfo, now_us,
                    "[security] exclude and the public keys are read again; robots excluded: %",
                    static_cast<std::int64_t>(excluded_.size()));
    if (!ignored_keys_.empty()) {
      ignored_keys_ = "changes are ignored until the node is started again: " + ignored_keys_;
      log_.say_change(LogLevel::kWarning, now_us, ignored_keys_.c_str());
    }
  }
  save_allocations_ += thread_heap_allocations().value_or(0) - before;
}

void Node::apply_security() {
  SecurityUpdate* const update = updates_.waiting();
  if (update == nullptr) return;
  keys_->swap_public_keys(update->keys);
  set_excluded(update->exclude);
  updates_.done();
}

/// In the sharing thread, or before it runs. A robot that is taken off the list comes back as a
/// newcomer does.
void Node::set_excluded(std::span<const std::uint32_t> robots) {
  door_->set_excluded(robots);
  exclude_digest_ = exclude_digest(robots);
  Exchange& exchange = robot_->exchange();
  std::array<std::uint32_t, ExchangeConfig::kMostExcluded> before{};
  const std::size_t count = exchange.excluded().size();
  std::copy_n(exchange.excluded().begin(), count, before.begin());
  for (const std::uint32_t robot : std::span(before).first(count)) {
    if (std::find(robots.begin(), robots.end(), robot) == robots.end()) exchange.include(robot);
  }
  for (const std::uint32_t robot : robots) {
    // The configuration names at most as many as have a place, and not this robot.
    if (exchange.exclude(robot) != Status::kOk)
      sharing_log_.say(LogLevel::kError, MonotonicClock::now_us(), "robot % cannot be excluded",
                       static_cast<std::int64_t>(robot));
  }
}

}  // namespace tessera
