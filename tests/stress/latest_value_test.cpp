// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "base/latest_value.hpp"

#include <array>
#include <atomic>
#include <catch2/catch.hpp>
#include <cstdint>
#include <thread>
#include <vector>

namespace tessera {
namespace {

struct Sample {
  std::array<std::uint64_t, 40> words{};
  std::uint8_t odd_size = 7;
};

TEST_CASE("LatestValue: a default before the first, then the latest") {
  LatestValue<Sample> cell;
  Sample got;
  got.words.fill(9);
  REQUIRE(cell.get(got));
  CHECK(got.words[39] == 0);
  CHECK(got.odd_size == 7);
  CHECK(cell.version() == 0);
  for (std::uint64_t i = 1; i <= 3; ++i) {
    Sample sample;
    sample.words.fill(i);
    sample.odd_size = static_cast<std::uint8_t>(i);
    cell.set(sample);
    CHECK(cell.version() == i);
  }
  REQUIRE(cell.get(got));
  CHECK(got.words[0] == 3);
  CHECK(got.words[39] == 3);
  CHECK(got.odd_size == 3);
}

TEST_CASE("LatestValue: readers never see a mixture, and never go back") {
  LatestValue<Sample> cell;
  constexpr std::uint64_t kValues = 30'000;
  std::atomic<std::uint64_t> mixed{0};
  std::atomic<std::uint64_t> back{0};
  std::atomic<std::uint64_t> reads{0};
  std::atomic<bool> done{false};
  std::vector<std::thread> readers;
  for (int i = 0; i < 2; ++i) {
    readers.emplace_back([&] {
      Sample got;
      std::uint64_t last = 0;
      bool last_round = false;
      while (!last_round) {
        last_round = done;
        if (!cell.get(got)) continue;
        ++reads;
        for (const std::uint64_t word : got.words) mixed += word == got.words[0] ? 0 : 1;
        back += got.words[0] < last ? 1 : 0;
        last = got.words[0];
      }
      if (last != kValues) ++back;
    });
  }
  Sample sample;
  for (std::uint64_t i = 1; i <= kValues || reads < 1000; ++i) {
    sample.words.fill(i < kValues ? i : kValues);
    cell.set(sample);
  }
  done = true;
  for (std::thread& reader : readers) reader.join();
  CHECK(mixed == 0);
  CHECK(back == 0);
}

}  // namespace
}  // namespace tessera
