// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a node reads again of its configuration while it runs: the exclude list, the public keys and
// the maps of earlier days.
#include <algorithm>
#include <array>

#include "base/allocation_counter.hpp"
#include "base/monotonic_clock.hpp"
#include "node/node.hpp"

namespace tessera {

namespace {

/// "[map] resolution_m, [run] tick_ms": keys whose values differ, other than those that are
/// read again.
std::string changed_keys(const Json& before, const Json& after) {
  std::string keys;
  for (const auto& [table, values] : after.items()) {
    if (table == "sessions") continue;
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
  TESSERA_TRY_ASSIGN(const NodeConfig next, read_node_config(config_.places.path()));
  TESSERA_TRY_ASSIGN(FleetKeys keys, FleetKeys::read(config_.keys, config_.robot));
  excluded_ = next.exclude;
  sessions_.want(next.sessions);
  ignored_keys_ = changed_keys(config_.values, next.values);
  const std::string secrets = keys_->changed_secrets(config_.keys, keys);
  if (!secrets.empty()) ignored_keys_ += (ignored_keys_.empty() ? "" : ", ") + secrets;
  updates_.offer(std::make_unique<SecurityUpdate>(SecurityUpdate{next.exclude, std::move(keys)}));
  return {};
}

/// This thread writes the log, so texts stay valid until they are written.
void Node::reload() {
  const std::uint64_t before = thread_heap_allocations().value_or(0);
  const std::int64_t now_us = MonotonicClock::now_us();
  const Outcome<void> read = read_again();
  if (!read.ok()) {
    reload_failure_ = "nothing was reloaded: " + read.failure().text(Speaker::kFile);
    log_.say_change(LogLevel::kError, now_us, reload_failure_.c_str());
  } else {
    log_.say_change(
        LogLevel::kInfo, now_us,
        "[security] exclude, the public keys and [[sessions]] were reloaded; robots excluded: %",
        static_cast<std::int64_t>(excluded_.size()));
    if (!ignored_keys_.empty()) {
      ignored_keys_ = "changes are ignored until the node is restarted: " + ignored_keys_;
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

/// Called in the sharing thread, or before it runs. A robot that is removed from the list comes
/// back as a new one.
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
    // The configuration has at most as many as there are places, and not this robot.
    if (exchange.exclude(robot) != Status::kOk)
      sharing_log_.say(LogLevel::kError, MonotonicClock::now_us(), "robot % cannot be excluded",
                       static_cast<std::int64_t>(robot));
  }
}

}  // namespace tessera
