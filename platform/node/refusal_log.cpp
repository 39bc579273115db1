// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "node/refusal_log.hpp"

namespace tessera {

namespace {

struct Watched {
  std::uint64_t value;
  const char* text;      ///< % stands for the increase.
  bool at_once = false;  ///< Logged even if it happens once, and as an error.
};

auto counters_of(const RefusalCounters& counted) {
  const LinkReport& l = counted.link;
  const ExchangeReport& e = counted.exchange;
  const SideReport& s = counted.statuses;
  const StatusTableReport& t = counted.table;
  const GlobalMapReport& g = counted.global_map;
  return std::array{
      Watched{l.refused_mission,
              "link refused_mission: % datagrams of another mission, or of robots without a fleet "
              "key; see [security] mission and fleet_key"},
      Watched{l.refused_tag,
              "link refused_tag: % datagrams without this fleet's tag; another [security] "
              "fleet_key, or a flood: limit it by its source, docs/reference/network.md"},
      Watched{l.refused_format,
              "link refused_format: % datagrams not of this version; another release, or a "
              "flood: limit it by its source, docs/reference/network.md"},
      Watched{l.refused_excluded,
              "link refused_excluded: % datagrams of robots of [security] exclude"},
      Watched{l.queue_full, "link queue_full: % datagrams lost; give more [network] receive_slots"},
      Watched{l.kernel_dropped,
              "link kernel_dropped: % datagrams lost; raise recv_buf_size and net.core.rmem_max, "
              "or limit "
              "a flood by its source, docs/reference/network.md"},
      Watched{l.fragments + l.foreign + l.no_channel + l.too_short + l.too_long,
              "link fragments, foreign, no_channel, too_short, too_long: % foreign packets; "
              "limit them by their source, docs/reference/network.md"},
      Watched{l.failed, "link failed: % datagrams not sent; see the MTU and the send buffer"},
      Watched{e.refused_size, "exchange refused_size: % datagrams"},
      Watched{e.refused_format, "exchange refused_format: % datagrams"},
      Watched{e.refused_mission,
              "exchange refused_mission: % datagrams of another mission; see [security] mission"},
      Watched{e.refused_tag, "exchange refused_tag: % datagrams"},
      Watched{e.refused_signature,
              "exchange refused_signature: % datagrams; see [security] robot_public_keys of all "
              "robots"},
      Watched{e.refused_configuration,
              "exchange refused_configuration: % datagrams of robots with another [map]; the "
              "report says "
              "what differs"},
      Watched{e.refused_rate,
              "exchange refused_rate: % signed messages, more than a robot may send"},
      Watched{e.refused_epochs, "exchange refused_epochs: % datagrams of epochs that are over"},
      Watched{e.conflicts,
              "exchange conflicts: % contents signed for a version that has another one; a robot's "
              "state was copied, or its key was stolen",
              true},
      Watched{e.twins,
              "exchange twins: % times another robot's number was used by two processes; give each "
              "robot its own [robot] id and state",
              true},
      Watched{e.refused_replay,
              "exchange refused_replay: % datagrams heard before, or of an old session"},
      Watched{
          e.refused_excluded,
          "exchange refused_excluded: % datagrams of robots that [security] exclude names, or that "
          "are banned"},
      Watched{e.refused_peers, "exchange refused_peers: % datagrams; give more [network] peers"},
      Watched{e.refused_body,
              "exchange refused_body: % datagrams with a valid tag and invalid content"},
      Watched{e.records_refused,
              "exchange records_refused: % records of other robots; see [fusion] memory and "
              "robot_share"},
      Watched{e.refused_contributions,
              "exchange refused_contributions: % times no free place; give more [network] "
              "contributions"},
      Watched{
          e.displaced_contributions,
          "exchange displaced_contributions: % contributions of other robots displaced; give more "
          "[network] contributions"},
      Watched{e.refused_disputed,
              "exchange refused_disputed: % times data of an epoch that a proof of a conflict "
              "has ended"},
      Watched{e.banned,
              "exchange banned: % robots signed two contents of one version three times and are "
              "excluded",
              true},
      Watched{e.refused_answers, "exchange refused_answers: % requests; too many at once"},
      Watched{e.refused_parts,
              "exchange refused_parts: % parts of this robot's own; give more [fusion] memory"},
      Watched{s.refused_format,
              "status refused_format: % statuses not of this version; another release"},
      Watched{s.refused_tag, "status refused_tag: % statuses without this fleet's tag"},
      Watched{s.refused_excluded, "status refused_excluded: % statuses of [security] exclude"},
      Watched{s.queue_full, "status queue_full: % statuses lost"},
      Watched{t.refused_robot, "status refused_robot: % statuses with this robot's number"},
      Watched{t.refused_replay,
              "status refused_replay: % statuses heard before, or of an old session"},
      Watched{t.refused_rate, "status refused_rate: % statuses, more than are checked"},
      Watched{
          t.refused_signature,
          "status refused_signature: % statuses; see [security] robot_public_keys of all robots"},
      Watched{t.refused_places,
              "status refused_places: % statuses of more robots than there are places"},
      Watched{
          g.refused_blocks,
          "global_map refused_blocks: % blocks without a free place; give more [fusion] memory"},
      Watched{
          g.refused_outputs,
          "global_map refused_outputs: % times no memory for a block; give more [fusion] memory"},
      Watched{g.refused_sums,
              "global_map refused_sums: % times a block stayed undiffused; give more [fusion] "
              "memory"},
      Watched{g.refused_tallies,
              "global_map refused_tallies: % times a block was not asked how reliable robots are; "
              "give more [fusion] memory"},
      Watched{
          g.torn_blocks,
          "global_map torn_blocks: % blocks of a contribution that moved were shown early; give "
          "more [fusion] memory"},
      Watched{counted.floors_refused,
              "state floors_refused: % times the lowest epoch of another robot was not stored; "
              "there are more robots than [robot] state has room for"},
  };
}

}  // namespace

bool RefusalLog::is_due(Watch& watch, std::uint64_t value, bool at_once,
                        std::int64_t now_us) noexcept {
  const bool is_quiet = now_us - watch.told_us < kPeriod_us;
  if (at_once) return value != watch.told && !is_quiet;
  if (value == watch.seen) return false;
  watch.seen = value;
  const bool lasts = now_us - watch.grew_us <= kPeriod_us;
  watch.grew_us = now_us;
  return lasts && !is_quiet;
}

void RefusalLog::look(const RefusalCounters& counted, std::int64_t now_us, LogQueue& log) noexcept {
  if (now_us - looked_us_ < kLook_us) return;
  looked_us_ = now_us;
  const auto counters = counters_of(counted);
  static_assert(counters.size() == kCounters);
  for (std::size_t i = 0; i < kCounters; ++i) {
    Watch& watch = watches_[i];
    const Watched& counter = counters[i];
    if (!is_due(watch, counter.value, counter.at_once, now_us)) continue;
    log.say(counter.at_once ? LogLevel::kError : LogLevel::kWarning, now_us, counter.text,
            static_cast<std::int64_t>(counter.value - watch.told));
    watch.told = counter.value;
    watch.told_us = now_us;
  }
}

}  // namespace tessera
