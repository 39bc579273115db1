// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include <sys/resource.h>

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "base/counters_json.hpp"
#include "base/monotonic_clock.hpp"
#include "network/held.hpp"
#include "processes/member.hpp"

namespace tessera::processes {

namespace {

using Json = nlohmann::ordered_json;

/// What stands before the payload of a datagram: the channel with its zero, LCM, UDP, IP.
constexpr std::uint64_t kBeforePayload = 8 + 8 + 8 + 20;

std::string hex(std::uint64_t value) {
  std::array<char, 17> text{};
  std::snprintf(text.data(), text.size(), "%016llx", static_cast<unsigned long long>(value));
  return text.data();
}

double seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

/// Of all threads of this process, user and system.
double cpu_s() {
  rusage used{};
  ::getrusage(RUSAGE_SELF, &used);
  return seconds(used.ru_utime) + seconds(used.ru_stime);
}

}  // namespace

std::string Member::report() const {
  const int components = classes_.num_components();
  const ExchangeReport exchange = exchange_.report();
  const LinkReport link = link_->report();
  Json contributions = Json::array();
  for (const network::Held& held : network::held(replicas_, components)) {
    const Replicas::Contribution& contribution = replicas_.contribution(*replicas_.find(held.id));
    contributions.push_back({{"robot", held.id.robot},
                             {"epoch", held.id.epoch},
                             {"frame_revision", held.frame_revision},
                             {"a_point", contribution.T_global_local.to_global({10, 20, 30})},
                             {"blocks", held.blocks},
                             {"label_evidence", held.label_evidence},
                             {"passes", held.passes},
                             {"digest", hex(held.digest)}});
  }
  std::vector<ContributionState> states(exchange.contributions);
  states.resize(std::min(states.size(), exchange_.contributions(states)));
  Json known = Json::array();
  for (const ContributionState& state : states) {
    known.push_back({{"robot", state.id.robot},
                     {"epoch", state.id.epoch},
                     {"records", state.records},
                     {"complete", state.complete}});
  }
  Json mismatches = Json::array();
  Json left = Json::array();
  for (const Peer& peer : exchange_.peers().all()) {
    if (peer.left) left.push_back(peer.robot);
    if (peer.mismatch)
      mismatches.push_back({{"robot", peer.robot}, {"resolution_m", peer.mismatch->resolution_m}});
  }
  const Json report{{"robot", config_.robot},
                    {"session", config_.session},
                    {"epoch", epoch_},
                    {"digest", hex(exchange_.digest())},
                    {"content", hex(network::content_digest(replicas_, components))},
                    {"known", exchange.contributions},
                    {"complete", exchange.complete},
                    {"names", known},
                    {"parts", replicas_.usage().replica_blocks},
                    {"contributions", contributions},
                    {"mismatches", mismatches},
                    {"left", left},
                    {"published", published_},
                    {"published_all", published_ >= blocks_in_all()},
                    {"published_bytes", published_bytes_},
                    {"now_s", 1e-6 * static_cast<double>(MonotonicClock::now_us())},
                    {"start_s", 1e-6 * static_cast<double>(start_us_)},
                    {"published_s", 1e-6 * static_cast<double>(published_us_)},
                    {"changed_s", 1e-6 * static_cast<double>(changed_us_)},
                    {"cpu_s", cpu_s()},
                    {"wire_bytes", link.sent_bytes + kBeforePayload * link.sent},
                    {"heard_bytes", link.received_bytes + kBeforePayload * link.received},
                    {"exchange", counters_json(exchange)},
                    {"link", counters_json(link)}};
  return report.dump();
}

}  // namespace tessera::processes
