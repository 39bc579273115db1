// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "base/spsc_queue.hpp"

#include <array>
#include <catch2/catch.hpp>
#include <cstdint>
#include <thread>

namespace tessera {
namespace {

TEST_CASE("SpscQueue: one less than full, full, and again with room") {
  SpscQueue<int> queue(4);
  REQUIRE(queue.capacity() == 4);
  CHECK(queue.front() == nullptr);
  for (int i = 0; i < 3; ++i) {
    int* const slot = queue.claim();
    REQUIRE(slot != nullptr);
    *slot = i;
    queue.publish();
  }
  CHECK(queue.size() == 3);
  REQUIRE(queue.claim() != nullptr);
  *queue.claim() = 3;  // The same slot: it was not published.
  queue.publish();
  CHECK(queue.claim() == nullptr);
  REQUIRE(queue.front() != nullptr);
  CHECK(*queue.front() == 0);
  queue.pop();
  CHECK(queue.claim() != nullptr);
  for (int i = 1; i < 4; ++i) {
    REQUIRE(queue.front() != nullptr);
    CHECK(*queue.front() == i);
    queue.pop();
  }
  CHECK(queue.front() == nullptr);
  CHECK(queue.peak() == 4);
}

TEST_CASE("SpscQueue: capacities are powers of two, from 1") {
  CHECK(SpscQueue<int>(0).capacity() == 1);
  CHECK(SpscQueue<int>(1).capacity() == 1);
  CHECK(SpscQueue<int>(5).capacity() == 8);
}

TEST_CASE("SpscQueue: everything arrives once, in order and whole, from another thread") {
  struct Slot {
    std::array<std::uint64_t, 8> words{};
  };
  constexpr std::uint64_t kItems = 50'000;
  SpscQueue<Slot> queue(16);
  std::thread writer([&queue] {
    for (std::uint64_t i = 0; i < kItems;) {
      Slot* const slot = queue.claim();
      if (slot == nullptr) {
        std::this_thread::yield();
        continue;
      }
      slot->words.fill(i++);
      queue.publish();
    }
  });
  std::uint64_t wrong = 0;
  for (std::uint64_t i = 0; i < kItems;) {
    const Slot* const slot = queue.front();
    if (slot == nullptr) {
      std::this_thread::yield();
      continue;
    }
    for (const std::uint64_t word : slot->words) wrong += word == i ? 0 : 1;
    queue.pop();
    ++i;
  }
  writer.join();
  CHECK(wrong == 0);
  CHECK(queue.front() == nullptr);
  CHECK(queue.peak() <= queue.capacity());
}

}  // namespace
}  // namespace tessera
