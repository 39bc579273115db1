// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The laws of deadlines, under clocks that the test moves: what is written is whole, from the
// sensor outwards, and ends within one quantum of the time; with time enough nothing is different.
#include <algorithm>
#include <array>
#include <bit>
#include <catch2/catch.hpp>
#include <cmath>
#include <optional>

#include "laws/moved_clocks.hpp"
#include "support/mapper.hpp"

namespace tessera::oracle {
namespace {

struct Setting {
  InferenceMode mode = InferenceMode::kCounting;
  bool free_space = true;
  std::uint64_t work_budget = 0;
};

const std::array<Setting, 7> kSettings{Setting{InferenceMode::kCounting, true, 0},
                                       Setting{InferenceMode::kKernel, true, 0},
                                       Setting{InferenceMode::kMultiEntropy, true, 0},
                                       Setting{InferenceMode::kMultiEntropy, false, 0},
                                       Setting{InferenceMode::kMultiEntropy, true, 40000},
                                       Setting{InferenceMode::kLattice, true, 0},
                                       Setting{InferenceMode::kLattice, false, 0}};
/// So fast that only a reading that finds the time up can end anything.
constexpr double kFast = 1e12;
constexpr float kRange_m = 5.0F;
constexpr std::int64_t kNever = std::int64_t{1} << 60U;

InferenceConfig config_of(const Setting& setting) {
  InferenceConfig config;
  config.mode = setting.mode;
  config.free_space.enabled = setting.free_space;
  config.free_space.carving = Carving::kRays;
  config.kernel_length_m = 0.27F;
  config.min_range_m = 0.05F;
  config.max_range_m = kRange_m;
  config.thinning_m = 0.0;
  config.work_budget = setting.work_budget;
  return config;
}

Point3f end_of(const Point3d& p) {
  return (p.normalized() * static_cast<double>(kRange_m)).cast<float>();
}

Cloud scan_of(std::uint64_t seed) {
  Random random(seed);
  Cloud cloud = random_cloud(random, {.points = 300, .classes = 5});
  while (cloud.size() < 320) {
    const Point3f given(static_cast<float>(random.uniform(5.5, 8)),
                        static_cast<float>(random.uniform(-12, 12)),
                        static_cast<float>(random.uniform(-3, 3)));
    // So that the ray has the same end when it is handed in again.
    const Point3f end = end_of(given.cast<double>());
    if (end_of(2.0 * end.cast<double>()) != end) continue;
    const Point3d p = given.cast<double>();
    cloud.add(p.x(), p.y(), p.z(), 1);
  }
  return cloud;
}

ScanReport integrate(Mapper& mapper, const Cloud& cloud, Deadline& deadline, std::int64_t due_us) {
  return mapper.integrator().integrate(mapper.map(), cloud.view(), deadline, due_us);
}

struct Part {
  bool as_before = true;
  bool as_after = true;
};

VoxelEvidence evidence_at(const LocalMap& map, BlockCoord at, int octet, int voxel) {
  const Block* const block = map.find(at);
  return block == nullptr ? VoxelEvidence{} : map.evidence(*block, octet, voxel);
}

bool same_bits(float a, float b) {
  return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b);
}

bool same_labels(const VoxelEvidence& a, const VoxelEvidence& b) {
  bool same = same_bits(a.rest, b.rest);
  for (std::size_t l = 1; l < a.sigma.size(); ++l) same = same && same_bits(a.sigma[l], b.sigma[l]);
  return same;
}

/// How the label and the free evidence of a block compare with the maps before and after.
std::array<Part, 2> parts_of(BlockCoord at, const LocalMap& map, const LocalMap& before,
                             const LocalMap& after) {
  std::array<Part, 2> parts;
  for (int i = 0; i < kBlockVoxels; ++i) {
    const auto here = [&](const LocalMap& of) { return evidence_at(of, at, i / 8, i % 8); };
    const VoxelEvidence now = here(map);
    const VoxelEvidence old = here(before);
    const VoxelEvidence full = here(after);
    parts[0].as_before = parts[0].as_before && same_labels(now, old);
    parts[0].as_after = parts[0].as_after && same_labels(now, full);
    parts[1].as_before = parts[1].as_before && same_bits(now.sigma[0], old.sigma[0]);
    parts[1].as_after = parts[1].as_after && same_bits(now.sigma[0], full.sigma[0]);
  }
  return parts;
}

int ring_of(BlockCoord at) {
  const int reach = std::max({std::abs(at.x), std::abs(at.y), std::abs(at.z)});
  return static_cast<int>(std::bit_width(static_cast<unsigned>(reach)));
}

struct Seen {
  int labels_cut = 0;
  int free_cut = 0;
  int nothing_written = 0;
  int rays_cut = 0;
  int whole = 0;
};

/// The first scan without a deadline, the second until due_us.
void check_cut(const Setting& setting, std::int64_t due_us, double rate, Seen& seen) {
  CAPTURE(static_cast<int>(setting.mode), setting.free_space, setting.work_budget, due_us, rate);
  const InferenceConfig config = config_of(setting);
  Mapper mapper(uncapped_map(0.1), config, 5);
  Mapper before(uncapped_map(0.1), config, 5);
  mapper.integrate(scan_of(1));
  before.integrate(scan_of(1));
  StepClock steps;
  Deadline deadline(steps.clock(), rate);
  const ScanReport report = integrate(mapper, scan_of(2), deadline, due_us);
  // The reading that found the time up, and the one that took the lateness.
  CHECK(report.overshoot_us <= 1);
  CHECK(report.admitted + report.refused_deadline + report.refused_work == report.thinned);
  CHECK(empty_blocks(mapper.map()) == 0);
  InferenceConfig free_config = config;
  free_config.work_budget = 0;
  Mapper after(uncapped_map(0.1), free_config, 5);
  after.integrate(before.admitted_cloud());
  after.integrate(mapper.admitted_cloud());
  const bool cut = report.tiles_cut + report.ray_blocks_cut + report.rays_cut > 0;
  if (!cut) CHECK(same_content(mapper.map(), after.map()));
  std::size_t tiles_left = 0;
  int nearest_left = 99;
  int farthest_written = -1;
  std::vector<KeyedIndex> workspace(2 * after.map().block_count());
  for (const KeyedIndex& item : after.map().blocks_in_order(workspace)) {
    const BlockCoord at = unpack(BlockKey{item.key});
    const std::array<Part, 2> parts = parts_of(at, mapper.map(), before.map(), after.map());
    REQUIRE((parts[0].as_before || parts[0].as_after));
    if (report.rays_cut == 0) REQUIRE((parts[1].as_before || parts[1].as_after));
    if (report.tiles_cut > 0) REQUIRE(parts[1].as_before);
    if (parts[0].as_before && !parts[0].as_after) {
      ++tiles_left;
      nearest_left = std::min(nearest_left, ring_of(at));
    }
    if (parts[0].as_after && !parts[0].as_before)
      farthest_written = std::max(farthest_written, ring_of(at));
  }
  CHECK(tiles_left <= report.tiles_cut);
  CHECK(farthest_written <= nearest_left);
  seen.labels_cut += tiles_left > 0 && farthest_written >= 0 ? 1 : 0;
  seen.free_cut += report.tiles_cut == 0 && report.ray_blocks_cut > 0 ? 1 : 0;
  seen.nothing_written += report.admitted == 0 ? 1 : 0;
  seen.rays_cut += report.rays_cut > 0 ? 1 : 0;
  seen.whole += report.left_out_deadline() == 0 ? 1 : 0;
}

}  // namespace

TEST_CASE("deadline: each block's labels and free space are whole or untouched, from near to far") {
  const std::size_t which = GENERATE(range<std::size_t>(0, kSettings.size()));
  Seen seen;
  Mapper timed(uncapped_map(0.1), config_of(kSettings[which]), 5);
  timed.integrate(scan_of(1));
  StepClock steps;
  Deadline deadline(steps.clock(), kFast);
  integrate(timed, scan_of(2), deadline, kNever);
  // From time for nothing up to time enough, each reading of the clock at both ends.
  const std::int64_t all_us = steps.time_us;
  for (std::int64_t due_us = 1; due_us <= all_us;) {
    check_cut(kSettings[which], due_us, kFast, seen);
    const std::int64_t stride = due_us < 20 || due_us >= all_us - 12 ? 1 : due_us / 5;
    due_us = std::min(due_us + stride, std::max(due_us + 1, all_us - 12));
  }
  CHECK(seen.nothing_written > 3);
  CHECK(seen.labels_cut > 3);
  if (kSettings[which].free_space) CHECK(seen.free_cut > 0);
  CHECK(seen.whole > 0);
}

TEST_CASE("deadline: what is foreseen to be late is not admitted, and rays give way to labels") {
  const std::size_t which = GENERATE(1U, 2U, 4U);
  Seen seen;
  for (const double rate : {500.0, 2000.0, 4000.0, 6000.0, 8000.0, 24000.0}) {
    for (std::int64_t due_us = 5; due_us < 24; due_us += 2)
      check_cut(kSettings[which], due_us, rate, seen);
  }
  CHECK(seen.rays_cut > 0);
}

TEST_CASE("deadline: with time enough nothing is different, with no clock neither") {
  const std::size_t which = GENERATE(range<std::size_t>(0, kSettings.size()));
  const bool has_clock = GENERATE(false, true);
  CAPTURE(which, has_clock);
  const InferenceConfig config = config_of(kSettings[which]);
  Mapper mapper(uncapped_map(0.1), config, 5);
  Mapper plain(uncapped_map(0.1), config, 5);
  StepClock steps;
  Deadline deadline(has_clock ? steps.clock() : Clock{});
  for (std::uint64_t seed = 1; seed < 4; ++seed) {
    const ScanReport report = integrate(mapper, scan_of(seed), deadline, kNever);
    const ScanReport expected = plain.integrate(scan_of(seed));
    CHECK(report.left_out_deadline() == 0);
    CHECK(report.overshoot_us == 0);
    CHECK(report.admitted == expected.admitted);
    CHECK(report.rays == expected.rays);
    CHECK(report.refused_work == expected.refused_work);
    CHECK(report.voxel_updates == expected.voxel_updates);
    // With a deadline the kernel mode writes tile by tile, and passes over other voxels that no
    // point reaches.
    const bool same_work = config.mode != InferenceMode::kKernel;
    CHECK((!same_work || report.work_spent() == expected.work_spent()));
    CHECK(report.work_predicted >= expected.work_spent());
    CHECK(report.work_predicted >= report.work_spent());
    REQUIRE(same_content(mapper.map(), plain.map()));
  }
  CHECK((deadline.readings() > 0) == has_clock);
}

TEST_CASE("deadline: the same readings give the same map") {
  const Setting& setting = kSettings[2];
  for (const std::int64_t due_us : {30, 90, 200}) {
    std::array<std::optional<Mapper>, 2> mappers;
    for (std::optional<Mapper>& mapper : mappers) {
      mapper.emplace(uncapped_map(0.1), config_of(setting), 5);
      StepClock steps;
      Deadline deadline(steps.clock());
      for (std::uint64_t seed = 1; seed < 5; ++seed)
        integrate(*mapper, scan_of(seed), deadline, steps.time_us + due_us);
    }
    CHECK(same_content(mappers[0]->map(), mappers[1]->map()));
  }
}

TEST_CASE("deadline: the clock is read before every quantum of work") {
  Mapper mapper(uncapped_map(0.1), config_of(kSettings[2]), 5);
  StepClock steps;
  Deadline deadline(steps.clock());
  const ScanReport report = integrate(mapper, scan_of(1), deadline, kNever);
  REQUIRE(report.left_out() == 0);
  const std::uint64_t quanta = report.points / Integrator::kReturnBatch +
                               report.rays / Integrator::kRayBatch + report.tiles +
                               report.ray_blocks / Integrator::kBlockBatch;
  CHECK(deadline.readings() >= quanta);
}

TEST_CASE("deadline: where writing takes the time, it ends within one tile or batch of blocks") {
  const bool free_space = GENERATE(false, true);
  Mapper whole(uncapped_map(0.1), config_of({InferenceMode::kMultiEntropy, free_space, 0}), 5);
  whole.integrate(scan_of(3));
  const std::int64_t all = WritingClock{&whole.map()}.now();
  constexpr std::int64_t kQuantum = Integrator::kBlockBatch * kBlockVoxels;
  int cut = 0;
  for (std::int64_t due = 1; due < all; due += all / 23) {
    Mapper mapper(uncapped_map(0.1), config_of({InferenceMode::kMultiEntropy, free_space, 0}), 5);
    WritingClock writing{&mapper.map()};
    Deadline deadline(writing.clock(), kFast);
    const ScanReport report = integrate(mapper, scan_of(3), deadline, due);
    CAPTURE(due, all, report.tiles_cut, report.ray_blocks_cut);
    CHECK(report.overshoot_us <= (report.tiles_cut > 0 ? kBlockVoxels : kQuantum));
    CHECK(report.overshoot_us == std::max<std::int64_t>(0, writing.now() - due));
    CHECK(writing.now() >= std::min(due, all - 1));
    cut += report.tiles_cut + report.ray_blocks_cut > 0 ? 1 : 0;
  }
  CHECK(cut > (free_space ? 1 : 10));
}

TEST_CASE("deadline: a scan that cannot be registered in time changes no voxel and is counted") {
  Mapper mapper(uncapped_map(0.1), config_of(kSettings[2]), 5);
  StepClock steps;
  Deadline deadline(steps.clock());
  const Cloud cloud = scan_of(1);
  const ScanReport report = integrate(mapper, cloud, deadline, 0);
  CHECK(report.returns_cut == cloud.size());
  CHECK(report.left_out() == cloud.size());
  CHECK(report.admitted == 0);
  CHECK(mapper.map().block_count() == 0);
  CHECK(mapper.integrator().admitted().empty());
  CHECK(mapper.integrator().admitted_rays().empty());
}

}  // namespace tessera::oracle
