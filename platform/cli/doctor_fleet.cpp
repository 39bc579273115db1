// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Compares what robots report about themselves with a configuration.
#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "base/monotonic_clock.hpp"
#include "cli/doctor.hpp"
#include "link/datagram_link.hpp"
#include "link/fleet_keys.hpp"
#include "link/status_table.hpp"
#include "node/datagram_door.hpp"
#include "node/security_update.hpp"

namespace tessera {
namespace {

constexpr std::int64_t kListen_us = 2'000'000;  ///< Each robot sends its status once a second.
constexpr const char* kLists = "exclude lists";
constexpr const char* kNumbers = "robots' numbers";
constexpr const char* kSameLists = "the same [security] exclude on all robots";
constexpr const char* kContents = "contents";
constexpr const char* kOneContent = "one content for each version";
constexpr const char* kOneProcess = "one process for each number";

std::string named(const std::vector<std::uint32_t>& robots) {
  std::string text = robots.size() == 1 ? "robot " : "robots ";
  for (std::size_t i = 0; i < robots.size(); ++i)
    text += fmt::format("{}{}", (i == 0 ? "" : ", "), robots[i]);
  return text;
}

std::vector<Check> cannot_listen(const Failure& failure) {
  return {
      {kLists, CheckState::kAdvice, failure.text(), kSameLists, "fix that, and run doctor again"}};
}

void listen(DatagramLink& link, StatusTable& table) {
  std::array<std::byte, kMaxMessageBytes> buffer;
  const std::int64_t end_us = MonotonicClock::now_us() + kListen_us;
  for (std::int64_t now_us = MonotonicClock::now_us(); now_us < end_us;
       now_us = MonotonicClock::now_us()) {
    const DatagramLink::Received received = link.receive(buffer);
    if (received.bytes.empty()) {
      static_cast<void>(link.wait(end_us - now_us));
    } else {
      static_cast<void>(table.hear(received.bytes, now_us));
    }
  }
}

Check check_lists(const StatusTable& table, std::span<const std::uint32_t> excluded,
                  std::uint64_t refused) {
  if (table.entries().empty()) {
    const std::string found = fmt::format("no robot was heard; statuses refused: {}", refused);
    return {kLists, CheckState::kAdvice, found, kSameLists,
            refused == 0 ? "start a node with [run] status, then run doctor again"
                         : "give all robots the same keys, mission and release"};
  }
  const std::uint32_t digest = exclude_digest(excluded);
  std::vector<std::uint32_t> differ;
  for (const StatusTable::Entry& entry : table.entries())
    if (entry.status.exclude_digest != digest) differ.push_back(entry.status.robot);
  std::sort(differ.begin(), differ.end());
  if (differ.empty()) {
    return {kLists, CheckState::kGood,
            fmt::format("robots heard with this list: {}", table.entries().size()), kSameLists, ""};
  }
  return {kLists, CheckState::kAdvice, named(differ) + " with another list than this file",
          kSameLists, "write the same list on each, then tessera node --config FILE --reload"};
}

Check check_numbers(const StatusTable& table) {
  std::vector<std::uint32_t> own;
  std::vector<std::uint32_t> others;
  for (const StatusTable::Entry& entry : table.entries()) {
    if (entry.status.own_twins > 0) own.push_back(entry.status.robot);
    if (entry.status.other_twins > 0) others.push_back(entry.status.robot);
  }
  std::sort(own.begin(), own.end());
  std::sort(others.begin(), others.end());
  if (own.empty() && others.empty())
    return {kNumbers, CheckState::kGood, "no duplicate heard", kOneProcess, ""};
  std::string found;
  if (!own.empty()) found = named(own) + " heard another process under that number";
  if (!others.empty())
    found += (found.empty() ? "" : "; ") + named(others) + " heard two processes of another robot";
  return {kNumbers, CheckState::kAdvice, found, kOneProcess,
          "give each robot its own [robot] id and state, and start those robots again"};
}

Check check_contents(const StatusTable& table) {
  std::vector<std::uint32_t> counted;
  for (const StatusTable::Entry& entry : table.entries())
    if (entry.status.conflicts > 0) counted.push_back(entry.status.robot);
  std::sort(counted.begin(), counted.end());
  if (counted.empty()) return {kContents, CheckState::kGood, "no conflict heard", kOneContent, ""};
  return {kContents, CheckState::kAdvice, named(counted) + " heard two contents of one version",
          kOneContent,
          "the state of a robot was copied, or its key was stolen: give it a new state and key, "
          "or exclude it"};
}

}  // namespace

std::vector<Check> check_fleet(const NodeConfig& config) {
  Outcome<FleetKeys> keys = FleetKeys::read(config.keys, config.robot);
  if (!keys.ok()) return cannot_listen(keys.failure());
  const StatusKeys status{keys->status_authenticator(), keys->keys().signatures};
  DatagramDoor door(crc_authenticator(), status);
  door.set_excluded(config.exclude);
  LinkConfig link_config = config.link;
  link_config.channel = kStatusChannel;
  link_config.queue_slots = 256;
  link_config.check = door.status_check();
  const Outcome<std::unique_ptr<DatagramLink>> link = DatagramLink::open(link_config);
  if (!link.ok()) return cannot_listen(link.failure());
  // Includes the robot of the file: it may run with another list than the file now has.
  StatusTable table(status, {});
  listen(**link, table);
  const LinkReport s = (*link)->report();
  const std::uint64_t refused =
      s.refused_format + s.refused_tag + table.counters().refused_signature;
  std::vector<Check> checks{check_lists(table, config.exclude, refused)};
  if (!table.entries().empty()) {
    checks.push_back(check_numbers(table));
    checks.push_back(check_contents(table));
  }
  return checks;
}

}  // namespace tessera
