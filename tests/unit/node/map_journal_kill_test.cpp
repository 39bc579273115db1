// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A process that maps and keeps its map, killed at random moments; the next one continues.
#include <signal.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <catch2/catch.hpp>
#include <chrono>
#include <thread>

#include "maps/map_journal.hpp"
#include "support/random.hpp"
#include "support/small_map.hpp"
#include "support/temporary_folder.hpp"

namespace tessera {
namespace {

constexpr int kBlocks = 64;
constexpr std::uint64_t kEndless = ~std::uint64_t{0};

/// A scan adds one to a voxel in each of some blocks: which of them follows from its number.
bool is_in(std::uint64_t scan, int block) {
  return oracle::Random(scan * kBlocks + static_cast<std::uint64_t>(block)).below(4) == 0;
}
VoxelCoord voxel_of(int block) { return {8 * block, 0, 0}; }

/// So that counts tell how many scans there were.
MapConfig without_cap() {
  MapConfig config = config_of_pages(128);
  config.max_evidence = 0.0F;
  return config;
}

/// What both processes see.
struct Shared {
  std::atomic<std::uint64_t> mapped{0};   ///< Scans, of all processes; the next may be in part.
  std::atomic<std::uint64_t> durable{0};  ///< That were whole in the map when a step began.
};

/// Maps in one thread and keeps in another, until it is killed. 1: it could not begin.
[[noreturn]] void run(const std::string& path, std::uint64_t first, Shared& shared) {
  SmallMap map(without_cap());
  std::optional<JournalContent> found;
  if (::access(path.c_str(), F_OK) == 0) {
    auto read = read_journal(path, &map.map);
    if (!read.ok()) ::_exit(1);
    found = *read;
  }
  auto journal = MapJournal::make(path, map.map, {}, found ? &*found : nullptr, 16 << 10U);
  if (!journal.ok()) ::_exit(1);
  std::thread mapping([&] {
    for (std::uint64_t scan = first; scan != kEndless; ++scan) {
      for (int block = 0; block < kBlocks; ++block) {
        if (is_in(scan, block) && hit(map.map, voxel_of(block), 1, 1.0F) != Status::kOk) ::_exit(1);
      }
      shared.mapped.store(scan + 1);
    }
  });
  while (true) {
    const std::uint64_t before = shared.mapped.load();
    if (!(*journal)->step({}).ok()) ::_exit(1);
    if ((*journal)->is_whole()) shared.durable.store(before);
  }
}

/// Until a step of the process is durable: on a busy machine that takes longer than any pause.
[[nodiscard]] bool has_kept(const Shared& shared, std::uint64_t first) {
  for (int wait = 0; wait < 10'000 && shared.durable.load() <= first; ++wait) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return shared.durable.load() > first;
}

TEST_CASE("MapJournal: killed a hundred times, nothing durable is lost, and nothing counts twice") {
  const test::TemporaryFolder folder;
  const std::string path = folder.file("kept.tsj");
  void* const memory =
      ::mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  REQUIRE(memory != MAP_FAILED);
  Shared& shared = *new (memory) Shared;
  oracle::Random random(2111);
  std::array<double, kBlocks> base{};  // What the process that runs began with.
  std::uint64_t first = 0;
  for (int kill = 0; kill < 100; ++kill) {
    const ::pid_t child = ::fork();
    REQUIRE(child >= 0);
    if (child == 0) run(path, first, shared);
    // Every third one at any time from its start, so while it reads too; the others while they
    // keep.
    const bool is_any_time = kill % 3 == 0;
    const bool kept = is_any_time || has_kept(shared, first);
    std::this_thread::sleep_for(std::chrono::microseconds(1000 + random.below(49'000)));
    REQUIRE(::kill(child, SIGKILL) == 0);
    int status = 0;
    REQUIRE(::waitpid(child, &status, 0) == child);
    REQUIRE(WIFSIGNALED(status));  // Else it has ended by itself.
    REQUIRE(kept);

    SmallMap map(without_cap());
    const bool is_there = ::access(path.c_str(), F_OK) == 0;
    if (is_there) {
      const auto read = read_journal(path, &map.map);
      INFO(read.failure().text());
      REQUIRE(read.ok());
      // Nothing but the last record can be torn.
      REQUIRE(read->damaged_bytes == 0);
    }
    const std::uint64_t durable = std::max(first, shared.durable.load());
    const std::uint64_t mapped = shared.mapped.load();
    for (int block = 0; block < kBlocks; ++block) {
      const auto at = static_cast<std::size_t>(block);
      double least = base[at];
      for (std::uint64_t scan = first; scan < durable; ++scan) least += is_in(scan, block) ? 1 : 0;
      double most = least;
      for (std::uint64_t scan = durable; scan <= mapped; ++scan) most += is_in(scan, block) ? 1 : 0;
      const double found = label_evidence(map.map, voxel_of(block));
      INFO("kill " << kill << ", block " << block);
      REQUIRE(found >= least);
      REQUIRE(found <= most);
      base[at] = found;
    }
    first = mapped + 1;  // Scans are never mapped again.
    shared.mapped.store(first);
  }
  ::munmap(memory, sizeof(Shared));
}

}  // namespace
}  // namespace tessera
