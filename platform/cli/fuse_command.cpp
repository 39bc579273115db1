// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// tessera fuse: local maps to one global map by label diffusion.
#include <algorithm>
#include <cstdio>
#include <set>

#include "cli/command.hpp"
#include "cli/fuse_report.hpp"
#include "cli/number_options.hpp"
#include "mapping/number_text.hpp"
#include "posix/allocation_counter.hpp"
#include "posix/monotonic_clock.hpp"
#include "posix/progress.hpp"
#include "tessera/map/queries.hpp"

namespace tessera {

namespace {

/// Calls put(slot, key, version, packed) for every block of every map.
template <class Put>
void for_blocks(const std::vector<FuseInput>& inputs, Arena& arena, Put&& put) {
  const int components = inputs.front().stored->map.num_components();
  BlockContent content = *BlockContent::make(arena, components);
  const std::span<std::byte> packed = arena.take<std::byte>(most_packed_bytes(components));
  const std::span<KeyedIndex> workspace = arena.take<KeyedIndex>([&] {
    std::size_t most = 0;
    for (const FuseInput& input : inputs)
      most = std::max(most, 2 * input.stored->map.block_count());
    return most;
  }());
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    const LocalMap& map = inputs[i].stored->map;
    for (const KeyedIndex& item : map.blocks_in_order(workspace)) {
      const Block& block = map.block_at(item.index);
      content.clear();
      add_block(map, block, content);
      put(i, BlockKey{item.key}, block.revision + 1, packed.first(pack_block(content, packed)));
    }
  }
}

double ms_since(std::int64_t start_us) {
  return static_cast<double>(MonotonicClock::now_us() - start_us) / 1000.0;
}

/// Publishes every block and fuses. Nothing in here uses the heap unless it fails.
Outcome<void> fuse_all(const std::vector<FuseInput>& inputs, GlobalMap& global, Arena& scratch,
                       FuseRun& run) {
  const std::optional<std::uint64_t> before = heap_allocations();
  std::int64_t start_us = MonotonicClock::now_us();
  std::array<GlobalMap::Slot, Replicas::kMostContributions> slots{};
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    const Result<GlobalMap::Slot> slot = global.open(inputs[i].id, inputs[i].frame);
    if (!slot.ok())
      return Failure{inputs[i].path + " has no place in the global map; give fewer maps"};
    slots[i] = *slot;
  }
  Status status = Status::kOk;
  for_blocks(inputs, scratch,
             [&](std::size_t input, BlockKey key, std::uint32_t version,
                 std::span<const std::byte> packed) {
               const Result<Replicas::Change> put = global.put(slots[input], key, version, packed);
               // What has no room is counted there, and warned about in the end.
               if (!put.ok() && put.status() != Status::kResourceExhausted) status = put.status();
             });
  if (status != Status::kOk)
    return Failure{std::string("a block cannot be taken: ") + to_string(status),
                   FailureKind::kFailure};
  run.publish_ms = ms_since(start_us);
  start_us = MonotonicClock::now_us();
  const std::uint32_t total = global.waiting();
  Progress progress("fusing", total);
  while (global.busy()) {
    run.work += global.step(1U << 20U);
    progress.update(total - std::min(total, global.waiting()));
  }
  progress.finish();
  run.fuse_ms = ms_since(start_us);
  const std::optional<std::uint64_t> after = heap_allocations();
  if (before && after) run.heap_allocations = *after - *before;
  return {};
}

/// What eval and others ask of the record: the range that all maps were made with, else none.
Json record_of(const std::vector<FuseInput>& inputs, Json config) {
  for (const char* const key : {"maps", "out", "report", "transform", "memory"}) config.erase(key);
  const Json range = recorded_setting(inputs.front().stored->header, "max_range");
  const bool same = std::all_of(inputs.begin(), inputs.end(), [&](const FuseInput& input) {
    return recorded_setting(input.stored->header, "max_range") == range;
  });
  if (same && !range.is_null()) config["max_range"] = range;
  std::set<std::uint32_t> robots;
  for (const FuseInput& input : inputs) robots.insert(input.id.robot);
  config["robots"] = robots;
  return config;
}

Outcome<void> run_fuse(const FuseOptions& options) {
  const Outcome<void> number = check_number_of_maps(options.maps.size());
  if (!number.ok()) return number.failure();
  const Outcome<std::optional<std::size_t>> budget_bytes = memory_of(options);
  if (!budget_bytes.ok()) return budget_bytes.failure();
  const Outcome<void> places = check_outputs({{"--out", options.out}, {"--report", options.report}},
                                             files_of(options.maps, options.transforms, "FILE"));
  if (!places.ok()) return places.failure();
  const Outcome<std::vector<FuseInput>> inputs = load_inputs(options.maps, options.transforms);
  if (!inputs.ok()) return inputs.failure();
  const Outcome<void> robots = check_number_of_robots(*inputs);
  if (!robots.ok()) return robots.failure();
  const LocalMap& first = inputs->front().stored->map;
  const Outcome<DiffusionConfig> diffusion = diffusion_of(options.diffusion, first.config());
  if (!diffusion.ok()) return diffusion.failure();

  FuseRun run;
  run.pairs = align_inputs(*inputs);
  ReplicaDemand demand{.blocks = 1, .segments = 1};
  std::size_t most_blocks = 0;
  for (const FuseInput& input : *inputs) {
    most_blocks = std::max(most_blocks, input.stored->map.block_count());
    demand.blocks += static_cast<std::uint32_t>(input.stored->map.block_count());
    run.replica_voxels += input.stored->map.usage().label_voxels;
  }
  const int components = first.num_components();
  const std::size_t scratch_bytes = BlockContent::required_bytes(components) +
                                    arena_bytes<std::byte>(most_packed_bytes(components)) +
                                    arena_bytes<KeyedIndex>(2 * most_blocks);
  const Outcome<ArenaMemory> scratch = ArenaMemory::allocate(scratch_bytes);
  if (!scratch.ok()) return scratch.failure();
  Arena counting(scratch->span());
  for_blocks(*inputs, counting,
             [&](std::size_t, BlockKey, std::uint32_t, std::span<const std::byte> packed) {
               demand.segments += SegmentStore::segments_of(packed.size());
             });
  const Outcome<GlobalMapConfig> config =
      config_for(*inputs, options, *diffusion, demand, *budget_bytes);
  if (!config.ok()) return config.failure();
  run.config = *config;
  const std::size_t arena_size_bytes = GlobalMap::required_bytes(run.config, components);
  run.budget_bytes = budget_bytes->value_or(arena_size_bytes);
  const Outcome<ArenaMemory> memory = ArenaMemory::allocate(arena_size_bytes);
  if (!memory.ok()) return memory.failure();
  Arena arena(memory->span());
  Result<GlobalMap> global = GlobalMap::make(arena, run.config, first.classes());
  if (!global.ok())
    return Failure{std::string("the global map cannot be made: ") + to_string(global.status())};
  Arena working(scratch->span());
  const Outcome<void> fused = fuse_all(*inputs, *global, working, run);
  if (!fused.ok()) return fused.failure();
  run.report = global->report();
  run.usage = global->map().usage();
  run.free_voxels = global->map().count_free_voxels();
  std::vector<KeyedIndex> workspace = workspace_for(global->map());
  run.digest = digest(global->map(), workspace);
  const Json config_json = to_json(options, run.config, *budget_bytes);
  MapIdentity identity{.kind = MapKind::kGlobal};
  const Outcome<void> recorded = record_settings(record_of(*inputs, config_json), identity);
  if (!recorded.ok()) return recorded.failure();
  const Outcome<void> saved = save_map(global->map(), identity, workspace, options.out);
  if (!saved.ok()) return saved.failure();
  warn_of_losses(run);
  print_summary(run, *inputs, options.out);
  return write_report(to_json(run, *inputs, config_json), options.report);
}

}  // namespace

void add_fuse_command(CLI::App& app, int& exit_status) {
  CLI::App* const command =
      app.add_subcommand("fuse", "Local maps to one global map by label diffusion");
  auto o = std::make_shared<FuseOptions>();
  command->add_option("MAPS", o->maps, "Local maps of one resolution and the same classes")
      ->required();
  command->add_option("--out", o->out, "Global map to write")->required();
  command->add_option("--report", o->report, "JSON report to write");
  command
      ->add_option("--transform", o->transforms,
                   "MAP.tsm=T.txt: 4x4 matrix T_global_map, row by row [as the map says]")
      ->allow_extra_args(false);
  command
      ->add_option("--diffusion", o->diffusion.mode, "contractive, paper, or none (the plain sum)")
      ->check(CLI::IsMember({"contractive", "paper", "none"}))
      ->capture_default_str();
  command->add_option("--iterations", o->diffusion.iterations, "Iterations n [8; paper: 2]")
      ->check(whole_number<int>());
  command
      ->add_option("--diffusion-length", o->diffusion.length_m,
                   "Length D of its kernel, m [2 voxels; paper: 3]")
      ->check(decimal_number());
  command
      ->add_option("--alpha", o->diffusion.alpha,
                   "Share that neighbours give, 0 to 1 (contractive)")
      ->check(decimal_number())
      ->capture_default_str();
  command->add_option("--omega", o->diffusion.omega, "Weight of all evidence")
      ->check(decimal_number())
      ->capture_default_str();
  command
      ->add_option("--edge", o->diffusion.edge, "Edge term: none, label, similarity or confidence")
      ->check(CLI::IsMember({"none", "label", "similarity", "confidence"}))
      ->capture_default_str();
  command->add_option("--counts", o->counts, "dense or compact counts [as the maps]")
      ->check(CLI::IsMember({"dense", "compact"}));
  command->add_option("--memory", o->memory,
                      "Budget for the global map and its making, bytes or with K, M, G [what the "
                      "maps need]");
  command->add_flag("--whole-map", o->diffusion.whole_map,
                    "Diffuse wherever there are labels, not only where robots overlap");
  command->footer(
      "Example: tessera fuse robot_0.tsm robot_1.tsm --transform robot_1.tsm=T.txt --out "
      "global.tsm --report fuse.json");
  command->callback([o, &exit_status] {
    const Outcome<void> outcome = run_fuse(*o);
    if (!outcome.ok()) exit_status = fail(outcome.failure());
  });
}

}  // namespace tessera
