// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "refinement.hpp"

#include <algorithm>
#include <cstdio>

#include "base/arena_memory.hpp"
#include "teams.hpp"
#include "tessera/frames/frame_finder.hpp"
#include "tessera/frames/replica_sketch_source.hpp"
#include "tessera/frames/search_reach.hpp"
#include "thread_time.hpp"

#if __has_include(<valgrind/callgrind.h>)
#include <valgrind/callgrind.h>
#endif

namespace tessera::bench {

namespace {

/// What one robot has published: before its last scan, and with it.
struct Published {
  Contribution before;
  Contribution after;
};

Outcome<Published> publish(const RefinementOptions& options, int first, int last, MapConfig& config,
                           ClassTable& classes) {
  TESSERA_TRY_ASSIGN(
      const Scene scene,
      load_scene(options.dataset, {.first = first, .last = last, .labels = "predictions"}));
  Mode mode = kFreeSpaceMode;
  mode.max_range_m = static_cast<float>(options.max_range_m);
  TESSERA_TRY_ASSIGN(Mapper mapper, Mapper::make(mode, scene, options.resolution_m));
  Published made;
  for (std::size_t s = 0; s < scene.scans.size(); ++s) {
    if (s + 1 == scene.scans.size()) made.before = contribution_of(mapper);
    mapper.integrate(scene.scans[s]);
  }
  made.after = contribution_of(mapper);
  config = mapper.map().config();
  classes = scene.classes;
  return made;
}

class Refinement {
 public:
  Refinement(const std::array<Published, 2>& robots, const MapConfig& map,
             const ClassTable& classes)
      : robots_(robots), map_(map), classes_(classes) {}

  Outcome<void> set_up() {
    const std::array<Contribution, 2> all{robots_[0].after, robots_[1].after};
    config_ = config_for(map_, all).replicas;
    const int components = classes_.num_components();
    const std::size_t bytes = Replicas::required_bytes(config_) + FrameFinder::required_bytes() +
                              2 * ReplicaSketchSource::required_bytes(map_, components, config_);
    memory_ = ArenaMemory(bytes);
    Arena arena(memory_.span());
    replicas_ = *Replicas::make(arena, config_);
    finder_ = *FrameFinder::make(arena);
    for (ReplicaSketchSource& source : sources_)
      source = *ReplicaSketchSource::make(arena, map_, classes_, config_);
    for (std::uint32_t robot = 0; robot < 2; ++robot) {
      slots_[robot] = *replicas_.open({robot, 1, 0});
      for (const PublishedBlock& block : robots_[robot].before.blocks)
        static_cast<void>(replicas_.put(slots_[robot], block.key, 1, block.bytes));
    }
    return {};
  }

  /// The next so many of the blocks in which the last scan has changed something, of each robot.
  void change(std::size_t blocks) {
    for (std::uint32_t robot = 0; robot < 2; ++robot) {
      const std::vector<PublishedBlock>& after = robots_[robot].after.blocks;
      for (std::size_t n = 0; n < blocks && next_[robot] < after.size(); ++next_[robot]) {
        const PublishedBlock& block = after[next_[robot]];
        const Replicas::Replica* const held = replicas_.find(slots_[robot], block.key);
        if (held != nullptr && same(*held, block)) continue;
        static_cast<void>(replicas_.put(slots_[robot], block.key, 2, block.bytes));
        ++n;
      }
    }
  }

  void measure(const char* what, const FrameQuestion& question) {
    double longest_ms = 0.0;
#if defined(CALLGRIND_START_INSTRUMENTATION)
    CALLGRIND_START_INSTRUMENTATION;
    CALLGRIND_ZERO_STATS;
#endif
    const double begun_ms = thread_cpu_ms();
    for (std::size_t r = 0; r < 2; ++r)
      if (sources_[r].begin(replicas_, slots_[r]) != Status::kOk) std::abort();
    if (finder_.begin(sources_[0].source(), sources_[1].source(), question) != Status::kOk)
      std::abort();
    longest_ms = thread_cpu_ms() - begun_ms;
    double taken_ms = 0.0;
    for (bool done = false; !done;) {
      const double before_ms = thread_cpu_ms();
      done = finder_.step();
      longest_ms = std::max(longest_ms, thread_cpu_ms() - before_ms);
      if (!finder_.taken_in()) taken_ms = thread_cpu_ms() - begun_ms;
    }
    const double all_ms = thread_cpu_ms() - begun_ms;
#if defined(CALLGRIND_START_INSTRUMENTATION)
    CALLGRIND_DUMP_STATS_AT(what);
    CALLGRIND_STOP_INSTRUMENTATION;
#endif
    const FrameAnswer& answer = finder_.answer();
    const Point3d off = apply(answer.T_a_b, answer.middle_a) - answer.middle_a;
    std::printf("| %s | %u | %.0f | %.0f | %.1f | %u | %s, %.3f m off |\n", what,
                sources_[0].blocks_taken() + sources_[1].blocks_taken(), all_ms, taken_ms,
                longest_ms, finder_.steps(), to_string(answer.verdict), norm(off));
    std::fflush(stdout);
  }
  [[nodiscard]] const FrameAnswer& answer() const { return finder_.answer(); }

 private:
  [[nodiscard]] bool same(const Replicas::Replica& held, const PublishedBlock& block) {
    bytes_.resize(held.bytes);
    static_cast<void>(replicas_.read(held, bytes_));
    return bytes_ == block.bytes;
  }

  const std::array<Published, 2>& robots_;
  MapConfig map_;
  ClassTable classes_;
  ReplicasConfig config_;
  ArenaMemory memory_;
  Replicas replicas_;
  FrameFinder finder_;
  std::array<ReplicaSketchSource, 2> sources_;
  std::array<Replicas::Slot, 2> slots_{};
  std::array<std::size_t, 2> next_{};
  std::vector<std::byte> bytes_;
};

}  // namespace

Outcome<void> measure_refinement(const RefinementOptions& options) {
  std::array<Published, 2> robots;
  MapConfig map;
  ClassTable classes;
  const int middle = (options.first + options.last + 1) / 2;
  TESSERA_TRY_ASSIGN(robots[0], publish(options, options.first, middle - 1, map, classes));
  TESSERA_TRY_ASSIGN(robots[1], publish(options, middle, options.last, map, classes));
  for (const Published& robot : robots)
    std::printf("%llu label voxels in %zu blocks; before the last scan %zu blocks\n",
                static_cast<unsigned long long>(robot.after.label_voxels),
                robot.after.blocks.size(), robot.before.blocks.size());
  Refinement refinement(robots, map, classes);
  TESSERA_TRY(refinement.set_up());
  std::printf(
      "| search | blocks read | CPU, ms | of these, reading | longest step, ms | steps | answer "
      "|\n|---|---|---|---|---|---|---|\n");
  refinement.measure("from nothing, anywhere", {});
  const Matrix34d T = refinement.answer().T_a_b;
  refinement.measure("near, nothing changed", question_near(T, kNearGiven));
  refinement.measure("refined, nothing changed", refinement_of(T));
  for (const std::size_t blocks : {10U, 100U, 1'000U}) {
    refinement.change(blocks);
    const std::string what = "refined, " + std::to_string(blocks) + " blocks of each changed";
    refinement.measure(what.c_str(), refinement_of(T));
  }
  refinement.measure("near, nothing changed", question_near(T, kNearGiven));
  return {};
}

}  // namespace tessera::bench
