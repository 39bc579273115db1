// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A writer and two readers on one map, each in a thread of its own.
#pragma once

#include <array>
#include <atomic>
#include <catch2/catch.hpp>
#include <string>
#include <thread>
#include <vector>

#include "support/aligned_memory.hpp"
#include "support/random.hpp"
#include "tessera/map/map_reader.hpp"

namespace tessera {

#if defined(__SANITIZE_THREAD__)
inline constexpr bool kSlow = true;
#elif defined(__has_feature)
inline constexpr bool kSlow = __has_feature(thread_sanitizer);
#else
inline constexpr bool kSlow = false;
#endif
inline constexpr std::uint64_t kVoxelReads = kSlow ? 10000 : 100000;
inline constexpr std::uint64_t kBlockReads = kSlow ? 1500 : 8000;

inline constexpr int kClasses = 11;

struct OwnedMap {
  explicit OwnedMap(const MapConfig& config) : memory(required_bytes(config)) {
    ClassTable classes;
    for (int i = 1; i <= kClasses; ++i)
      REQUIRE(classes.add("class " + std::to_string(i), {}) == Status::kOk);
    Arena arena = memory.arena();
    Result<LocalMap> made = LocalMap::make(arena, config, classes);
    REQUIRE(made.ok());
    map = std::move(*made);
  }
  AlignedMemory memory;
  LocalMap map;
};

inline MapConfig config_of(TuplePolicy tuple, float max_evidence = 40.0F) {
  MapConfig config;
  config.tuple = tuple;
  config.storage_bytes = 600 * SlabPool::kPageBytes;
  config.max_evidence = max_evidence;
  config.free_weight = 4.0F;  // ten passes: labels give way often
  return config;
}

/// What all readers found, and when they are to stop.
struct Findings {
  std::atomic<bool> stop{false};
  std::atomic<std::uint64_t> reads{0};
  std::atomic<std::uint64_t> full{0};  ///< Reads that found label evidence.
  std::atomic<std::uint64_t> torn{0};
  std::atomic<std::uint64_t> busy{0};
};

/// Threads that end, also where a check of the writer fails.
struct Readers {
  Findings& findings;
  std::vector<std::thread> threads{};
  void join() {
    findings.stop = true;
    for (std::thread& thread : threads) thread.join();
    threads.clear();
  }
  ~Readers() { join(); }
};

/// Runs write(round) until the readers, two threads of read(reader, random), have found label
/// evidence so often; at least 48 rounds, and a bound that only readers who find nothing reach.
template <class Reader = MapReader, class Map, class Write, class Read>
void race(const Map& map, Findings& findings, std::uint64_t least_full, Write&& write,
          Read&& read) {
  constexpr int kLeastRounds = 48;
  constexpr int kMostRounds = 50000;
  Readers readers{findings};
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    readers.threads.emplace_back([&, seed] {
      Reader reader(map);
      oracle::Random random(seed);
      while (!findings.stop) {
        read(reader, random);
        ++findings.reads;
      }
      findings.busy += reader.busy();
    });
  }
  for (int round = 0; round < kMostRounds; ++round) {
    if (round >= kLeastRounds && findings.full >= least_full) break;
    write(round);
  }
  readers.join();
  CAPTURE(findings.reads.load(), findings.full.load(), findings.busy.load());
  CHECK(findings.torn == 0);
  CHECK(findings.full >= least_full);
}

}  // namespace tessera
