// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "link/status_table.hpp"

#include <algorithm>

namespace tessera {

PayloadVerdict StatusTable::hear(std::span<const std::byte> status, std::int64_t now_us,
                                 const PeerTable* peers) noexcept {
  const auto refuse = [](std::uint64_t& counter, PayloadVerdict verdict) {
    ++counter;
    return verdict;
  };
  const PayloadVerdict verdict = judge_status(status, keys_);
  if (verdict == PayloadVerdict::kFormat) return refuse(counters_.refused_format, verdict);
  if (verdict == PayloadVerdict::kTag) return refuse(counters_.refused_tag, verdict);
  const HeardState heard = read_status(status);
  if (heard.robot == own_robot_) return refuse(counters_.refused_robot, PayloadVerdict::kExcluded);
  Entry* entry = find(heard.robot);
  if (is_replay(entry, heard, now_us, peers))
    return refuse(counters_.refused_replay, PayloadVerdict::kExcluded);
  if (keys_.signatures.on() && !may_check(now_us))
    return refuse(counters_.refused_rate, PayloadVerdict::kExcluded);
  if (!check_status_signature(status, keys_))
    return refuse(counters_.refused_signature, PayloadVerdict::kTag);
  // Only now, so that invented robots take no place in a fleet that signs.
  if (entry == nullptr) entry = place_for_new(now_us);
  if (entry == nullptr) return refuse(counters_.refused_places, PayloadVerdict::kExcluded);
  const Place place{heard.session, heard.sequence};
  *entry = {heard, now_us, std::max(place, entry->highest)};
  ++counters_.taken;
  return PayloadVerdict::kTaken;
}

StatusTable::Entry* StatusTable::find(std::uint32_t robot) noexcept {
  const auto end = entries_.begin() + static_cast<std::ptrdiff_t>(count_);
  const auto found = std::find_if(entries_.begin(), end,
                                  [robot](const Entry& e) { return e.status.robot == robot; });
  return found == end ? nullptr : &*found;
}

StatusTable::Entry* StatusTable::place_for_new(std::int64_t now_us) noexcept {
  if (count_ < kMostRobots) return &entries_[count_++];
  const auto oldest = std::min_element(
      entries_.begin(), entries_.end(),
      [](const Entry& one, const Entry& other) { return one.heard_us < other.heard_us; });
  if (oldest->is_lately(now_us)) return nullptr;
  *oldest = {};
  return &*oldest;
}

bool StatusTable::is_replay(const Entry* before, const HeardState& now, std::int64_t now_us,
                            const PeerTable* peers) const noexcept {
  const Place place{now.session, now.sequence};
  if (!keys_.signatures.on())
    return before != nullptr && before->is_lately(now_us) && place <= before->place();
  const Peer* const peer = peers == nullptr ? nullptr : peers->find(now.robot);
  if (peer == nullptr || peer->control.heard == 0)
    return before != nullptr && place <= before->highest;
  if (now.session != peer->control.session) return true;
  if (before == nullptr) return false;
  const auto is_over = [&place](const Place& taken) {
    return place.first == taken.first && place.second <= taken.second;
  };
  return is_over(before->place()) || is_over(before->highest);
}

bool StatusTable::may_check(std::int64_t now_us) noexcept {
  if (now_us - second_us_ >= 1'000'000) {
    second_us_ = now_us;
    checks_ = 0;
  }
  return ++checks_ <= kChecksPerSecond;
}

}  // namespace tessera
