// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/robot/map_sessions.hpp"

#include <algorithm>

#include "tessera/exchange/internal/block_codec.hpp"
#include "tessera/map/internal/packed_block.hpp"

namespace tessera {

Result<MapSessions> MapSessions::make(Arena& arena, Exchange& exchange, const GlobalMap& global,
                                      int num_components, bool keep_earlier,
                                      bool has_frame) noexcept {
  MapSessions made;
  const Result<BlockContent> content = BlockContent::make(arena, num_components);
  if (!content.ok()) return content.status();
  made.content_ = *content;
  made.exchange_ = &exchange;
  made.global_ = &global;
  made.keep_earlier_ = keep_earlier;
  made.has_frame_ = has_frame;
  return made;
}

MapSessions::Session* MapSessions::find(std::uint32_t submap) noexcept {
  Session* const end = sessions_.data() + count_;
  Session* const at = std::find_if(sessions_.data(), end,
                                   [submap](const Session& one) { return one.submap == submap; });
  return at == end ? nullptr : at;
}

Result<std::uint32_t> MapSessions::open(const LocalMap& map, const MapSession& session,
                                        const Matrix34d& T_global_map) noexcept {
  if (!has_frame_) return Status::kUnsupported;
  const MapConfig& own = global_->config().map;
  if (map.config().resolution_m != own.resolution_m ||
      map.config().free_weight != own.free_weight || !(map.classes() == global_->map().classes()))
    return Status::kMismatch;
  const auto is_same = [&](const Session& one) {
    return one.state != State::kLeaving && one.session.digest == session.digest;
  };
  if (std::any_of(all().begin(), all().end(), is_same)) return Status::kInvalidArgument;
  if (count_ == kMost || opened_ == MapSession::kPlacesOfRobot) return Status::kResourceExhausted;
  const std::uint32_t submap = MapSession::kFirst + opened_;
  const Status status = exchange_->open_session(submap, session, T_global_map);
  if (status != Status::kOk) return status;
  ++opened_;
  sessions_[count_++] = {.submap = submap, .session = session};
  return submap;
}

Result<std::size_t> MapSessions::publish(std::uint32_t submap, const LocalMap& map,
                                         std::span<const KeyedIndex> blocks, std::size_t first,
                                         std::size_t count) noexcept {
  Session* const session = find(submap);
  if (session == nullptr || session->state != State::kPublishing) return Status::kInvalidArgument;
  const std::span<const KeyedIndex> left = blocks.subspan(std::min(first, blocks.size()));
  const std::size_t most = std::min(count, left.size());
  for (const KeyedIndex& item : left.first(most)) {
    content_.clear();
    add_block(map, map.block_at(item.index), content_);
    if (!content_.any()) continue;
    quantise(content_);
    if (exchange_->publish_earlier(submap, BlockKey{item.key}, content_).ok()) {
      ++session->blocks;
    } else {
      ++session->refused_blocks;
      ++refused_blocks_;
    }
  }
  if (most == 0) session->state = State::kShared;
  return most;
}

Status MapSessions::remove(std::uint32_t submap) noexcept {
  Session* const session = find(submap);
  if (session == nullptr || session->state == State::kLeaving) return Status::kInvalidArgument;
  const Status status = exchange_->end_session(submap);
  if (status != Status::kOk) return status;
  session->state = State::kLeaving;
  const std::uint32_t epoch = exchange_->publishing()->epoch;
  const std::uint32_t robot = exchange_->publishing()->robot;
  const Replicas& replicas = global_->replicas();
  const Result<Replicas::Slot> slot = replicas.find({robot, epoch, submap});
  session->next_record = slot.ok() ? replicas.contribution(*slot).first_block : 0;
  return Status::kOk;
}

void MapSessions::end_earlier() noexcept {
  keep_earlier_ = false;
  if (const auto now = exchange_->publishing()) exchange_->set_session_floor(now->epoch);
}

bool MapSessions::is_withdrawing() const noexcept {
  return std::any_of(all().begin(), all().end(),
                     [](const Session& one) { return one.state == State::kLeaving; });
}

/// A record that holds something is published empty; the list of records stays as it is meanwhile,
/// as none is dropped. False: the budget of blocks is used up.
bool MapSessions::withdraw(Session& session, std::size_t& left) noexcept {
  const Replicas& replicas = global_->replicas();
  while (session.next_record != 0) {
    const Replicas::Replica& record = replicas.record(session.next_record);
    if (record.bytes != 0) {
      if (left == 0) return false;
      --left;
      content_.clear();
      // Where that fails it holds a place, and counts nothing.
      static_cast<void>(exchange_->publish_earlier(session.submap, BlockKey{record.key}, content_));
    }
    session.next_record = record.next;
  }
  return true;
}

void MapSessions::tick() noexcept {
  std::size_t left = kBlocksOfTick;
  for (std::size_t i = 0; i < count_;) {
    if (sessions_[i].state != State::kLeaving || !withdraw(sessions_[i], left)) {
      ++i;
      continue;
    }
    std::copy(sessions_.begin() + static_cast<std::ptrdiff_t>(i) + 1,
              sessions_.begin() + static_cast<std::ptrdiff_t>(count_),
              sessions_.begin() + static_cast<std::ptrdiff_t>(i));
    --count_;
  }
}

void MapSessions::begin_epoch() noexcept {
  count_ = 0;
  opened_ = 0;
  if (!keep_earlier_) end_earlier();
}

}  // namespace tessera
