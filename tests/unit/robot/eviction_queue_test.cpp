// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The queue alone: who may leave, what is away, and that every block that asks gets its turn.
#include "tessera/robot/internal/eviction_queue.hpp"

#include <catch2/catch.hpp>
#include <vector>

#include "support/mapper.hpp"

namespace tessera {
namespace {

using Answer = EvictionQueue::Answer;

struct Held {
  explicit Held(std::size_t blocks) : memory(EvictionQueue::required_bytes(blocks)) {
    Arena arena(memory.span());
    queue = *EvictionQueue::make(arena, blocks);
    CHECK(arena.remaining_bytes() == 0);
  }
  /// A tick of who publishes, that settles all that ask, with these stamps.
  template <class StampOf>
  void settle_all(StampOf&& stamp_of) {
    queue->begin_tick([this](BlockKey key) {
      if (has_room) returned.push_back(key);
      return has_room;
    });
    for (LeavingBlock& block : queue->leaving()) block.stamp = stamp_of(block.key);
    queue->answer();
  }
  AlignedMemory memory;
  EvictionQueue* queue = nullptr;
  std::vector<BlockKey> returned;
  bool has_room = true;  ///< Of who publishes.
};

BlockKey key_of(int i) { return *pack({i % 256 - 128, i / 256, 0}); }

TEST_CASE("EvictionQueue: an answer is for the content that was published, and no other") {
  Held held(64);
  EvictionQueue& queue = *held.queue;
  queue.begin_step();
  CHECK(queue.answer_to(key_of(1), 8) == Answer::kNone);
  queue.ask(key_of(1), 8);
  queue.ask(key_of(2), 8);
  held.settle_all([](BlockKey key) { return key == key_of(1) ? 8U : 9U; });
  queue.begin_step();
  CHECK(queue.answer_to(key_of(1), 8) == Answer::kPublished);
  CHECK(queue.answer_to(key_of(1), 10) == Answer::kNone);  // it has changed since
  CHECK(queue.answer_to(key_of(2), 8) == Answer::kNotWhole);
  queue.ask(key_of(1), 10);
  held.settle_all([](BlockKey) { return 10U; });
  queue.begin_step();
  CHECK(queue.answer_to(key_of(1), 10) == Answer::kPublished);
}

TEST_CASE(
    "EvictionQueue: every block leaves, however many want to and however few are met a step") {
  const int blocks = GENERATE(1000, 10'000, 30'000);
  constexpr int kMet = 519;  // what MovingWindow looks at while blocks are refused
  Held held(64'000);
  EvictionQueue& queue = *held.queue;
  std::vector<int> rest(static_cast<std::size_t>(blocks));
  for (int i = 0; i < blocks; ++i) rest[static_cast<std::size_t>(i)] = i;
  std::size_t next = 0;
  int steps = 0;
  for (; !rest.empty() && steps < 3000; ++steps) {
    queue.begin_step();
    for (int met = 0; met < kMet && !rest.empty(); ++met) {
      if (next >= rest.size()) next = 0;
      const BlockKey key = key_of(rest[next]);
      if (queue.answer_to(key, 8) == Answer::kPublished) {
        queue.note_archived(key, true, true);
        rest[next] = rest.back();
        rest.pop_back();
      } else {
        queue.ask(key, 8);
        ++next;
      }
    }
    held.settle_all([](BlockKey) { return 8U; });
  }
  CHECK(rest.empty());
  CHECK(queue.unlisted() == 0);
}

TEST_CASE(
    "EvictionQueue: what is archived is away at once, what returns is whole at the next tick") {
  Held held(64);
  EvictionQueue& queue = *held.queue;
  queue.note_archived(key_of(1), true, true);
  CHECK(queue.is_away(key_of(1)));
  queue.note_reloaded(key_of(1));
  CHECK(queue.is_away(key_of(1)));  // a snapshot of this tick may be from before
  held.settle_all([](BlockKey) { return 0U; });
  CHECK_FALSE(queue.is_away(key_of(1)));
  CHECK(held.returned == std::vector<BlockKey>{key_of(1)});

  queue.note_archived(key_of(2), true, false);
  queue.note_reloaded(key_of(2));
  queue.note_archived(key_of(2), true, true);
  held.settle_all([](BlockKey) { return 0U; });
  CHECK(queue.is_away(key_of(2)));  // it went again before the tick
  CHECK(held.returned.size() == 1);
  CHECK(queue.unpublished() == 0);
}

TEST_CASE("EvictionQueue: no more is archived than there is room for, and clearing gives it back") {
  Held held(2);
  EvictionQueue& queue = *held.queue;
  queue.note_archived(key_of(1), true, false);
  queue.note_archived(key_of(1), false, true);
  CHECK(queue.may_archive());
  queue.note_archived(key_of(2), true, true);
  CHECK_FALSE(queue.may_archive());
  CHECK(queue.is_away(key_of(2)));
  CHECK(queue.unpublished() == 1);
  CHECK(queue.note_cleared());
  CHECK(queue.may_archive());
  CHECK_FALSE(queue.is_away(key_of(2)));
  CHECK(queue.unpublished() == 0);
}

TEST_CASE(
    "EvictionQueue: what was archived of a map that was cleared is withdrawn, each block once") {
  constexpr int kBlocks = 5000;
  Held held(kBlocks);
  EvictionQueue& queue = *held.queue;
  for (int i = 0; i < kBlocks; ++i) queue.note_archived(key_of(i), true, true);
  REQUIRE(queue.note_cleared());
  queue.note_archived(key_of(7), true, true);  // of the new map
  held.has_room = false;
  held.settle_all([](BlockKey) { return 0U; });
  CHECK(queue.is_withdrawing());
  CHECK(queue.is_away(key_of(7)));
  CHECK_FALSE(queue.is_away(key_of(8)));  // so that the new map's block can be published
  held.has_room = true;
  int ticks = 0;
  for (; queue.is_withdrawing() && ticks < 1000; ++ticks)
    held.settle_all([](BlockKey) { return 0U; });
  CHECK(ticks > 1);
  CHECK(ticks < 20);
  CHECK(held.returned.size() == kBlocks - 1);
  CHECK(queue.unpublished() == 0);
}

TEST_CASE("EvictionQueue: a new epoch has nothing of what was published") {
  Held held(64);
  EvictionQueue& queue = *held.queue;
  queue.note_archived(key_of(1), true, true);
  held.settle_all([](BlockKey) { return 0U; });
  queue.begin_epoch();
  CHECK(queue.unpublished() == 1);
  CHECK(queue.is_away(key_of(1)));
  REQUIRE(queue.list(key_of(2)));
  CHECK(queue.is_away(key_of(2)));
  CHECK(queue.unpublished() == 2);
}

}  // namespace
}  // namespace tessera
