// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "node/refusal_log.hpp"

namespace tessera {

namespace {

struct Counter {
  std::uint64_t value;
  const char* text;  ///< % stands for how much it grew.
};

auto counters_of(const LinkStatistics& l, const ExchangeReport& e, const SideStatistics& s,
                 const StatusCounters& t) {
  return std::array{
      Counter{
          l.refused_tag,
          "link refused_tag: % datagrams without this fleet's tag; another [security] fleet_key or "
          "mission, or a flood: limit it by its source, docs/network.md"},
      Counter{
          l.refused_format,
          "link refused_format: % datagrams that are none of this version; another release, or a "
          "flood: limit it by its source, docs/network.md"},
      Counter{l.refused_excluded,
              "link refused_excluded: % datagrams of robots of [security] exclude"},
      Counter{l.queue_full, "link queue_full: % datagrams lost; give more [network] receive_slots"},
      Counter{l.kernel_dropped,
              "link kernel_dropped: % datagrams lost; raise recv_buf_size and net.core.rmem_max, "
              "or limit "
              "a flood by its source, docs/network.md"},
      Counter{
          l.fragments + l.foreign + l.no_channel + l.too_short + l.too_long,
          "link fragments, foreign, no_channel, too_short, too_long: % packets of somebody else; "
          "limit them by their source, docs/network.md"},
      Counter{l.failed, "link failed: % datagrams not sent; see the MTU and the send buffer"},
      Counter{e.refused_size, "exchange refused_size: % datagrams"},
      Counter{e.refused_format, "exchange refused_format: % datagrams"},
      Counter{e.refused_mission,
              "exchange refused_mission: % datagrams of another mission; see [security] mission"},
      Counter{e.refused_tag, "exchange refused_tag: % datagrams"},
      Counter{e.refused_signature,
              "exchange refused_signature: % datagrams; see [security] robot_public_keys of all "
              "robots"},
      Counter{e.refused_configuration,
              "exchange refused_configuration: % datagrams of robots with another [map]; the "
              "report says "
              "what differs"},
      Counter{e.refused_rate,
              "exchange refused_rate: % signed messages, more than a robot may send"},
      Counter{e.refused_epochs, "exchange refused_epochs: % datagrams of epochs that are over"},
      Counter{e.conflicts,
              "exchange conflicts: % contents signed for a version that has another one; a robot's "
              "state "
              "was copied, or its key is in other hands"},
      Counter{e.twins, "exchange twins: % times another robot's number was used by two processes"},
      Counter{e.refused_replay,
              "exchange refused_replay: % datagrams heard before, or of an old session"},
      Counter{e.refused_excluded,
              "exchange refused_excluded: % datagrams of robots of [security] exclude"},
      Counter{e.refused_peers, "exchange refused_peers: % datagrams; give more [network] peers"},
      Counter{e.refused_body, "exchange refused_body: % datagrams with a tag and no sense"},
      Counter{e.records_refused,
              "exchange records_refused: % records of other robots; see [fusion] memory and "
              "robot_share"},
      Counter{
          e.refused_contributions,
          "exchange refused_contributions: % times no place; give more [network] contributions"},
      Counter{e.displaced_contributions,
              "exchange displaced_contributions: % without a frame lost their places"},
      Counter{e.refused_answers, "exchange refused_answers: % requests; too many at once"},
      Counter{e.refused_parts,
              "exchange refused_parts: % parts of this robot's own; give more [fusion] memory"},
      Counter{s.refused_format,
              "status refused_format: % statuses that are none of this version; another release"},
      Counter{s.refused_tag, "status refused_tag: % statuses without this fleet's tag"},
      Counter{s.refused_excluded, "status refused_excluded: % statuses of [security] exclude"},
      Counter{s.queue_full, "status queue_full: % statuses lost"},
      Counter{t.refused_robot, "status refused_robot: % statuses with this robot's number"},
      Counter{t.refused_replay,
              "status refused_replay: % statuses heard before, or of an old session"},
      Counter{t.refused_rate, "status refused_rate: % statuses, more than are checked"},
      Counter{
          t.refused_signature,
          "status refused_signature: % statuses; see [security] robot_public_keys of all robots"},
      Counter{t.refused_places,
              "status refused_places: % statuses of more robots than have a place"},
  };
}

}  // namespace

void RefusalLog::look(const LinkStatistics& link, const ExchangeReport& exchange,
                      const SideStatistics& statuses, const StatusCounters& table,
                      std::int64_t now_us, LogQueue& log) noexcept {
  if (now_us - looked_us_ < kLook_us) return;
  looked_us_ = now_us;
  const auto counters = counters_of(link, exchange, statuses, table);
  static_assert(counters.size() == kCounters);
  for (std::size_t i = 0; i < kCounters; ++i) {
    Watch& watch = watches_[i];
    const std::uint64_t value = counters[i].value;
    if (value == watch.seen) continue;
    watch.seen = value;
    const bool lasts = now_us - watch.grew_us <= kPeriod_us;
    watch.grew_us = now_us;
    if (!lasts || now_us - watch.told_us < kPeriod_us) continue;
    log.say(LogLevel::kWarning, now_us, counters[i].text,
            static_cast<std::int64_t>(value - watch.told));
    watch.told = value;
    watch.told_us = now_us;
  }
}

}  // namespace tessera
