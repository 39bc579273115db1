// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// tessera fuse: local maps to one global map by label diffusion.
#include <algorithm>
#include <cstdio>

#include "cli/command.hpp"
#include "cli/fuse_report.hpp"
#include "cli/number_text.hpp"
#include "cli/outputs.hpp"
#include "posix/allocation_counter.hpp"
#include "posix/monotonic_clock.hpp"
#include "posix/progress.hpp"
#include "tessera/map/queries.hpp"

namespace tessera {

namespace {

Failure out_of_range(const char* option, const std::string& given, const char* allowed) {
  return {std::string(option) + " " + given + " is not allowed; give " + allowed};
}

template <class Value>
std::optional<Value> named(const std::string& name, std::initializer_list<Value> values) {
  for (const Value value : values) {
    if (name == to_string(value)) return value;
  }
  return std::nullopt;
}

Outcome<DiffusionConfig> diffusion_of(const FuseOptions& options, const MapConfig& map) {
  DiffusionConfig config;
  config.mode = *named(options.diffusion,
                       {DiffusionMode::kContractive, DiffusionMode::kPaper, DiffusionMode::kNone});
  config.edge = *named(options.edge, {EdgeTerm::kNone, EdgeTerm::kLabel, EdgeTerm::kSimilarity,
                                      EdgeTerm::kConfidence});
  const bool paper = config.mode == DiffusionMode::kPaper;
  config.iterations = options.iterations.value_or(paper ? 2 : DiffusionConfig{}.iterations);
  config.length_m =
      static_cast<float>(options.length_m.value_or((paper ? 3.0 : 2.0) * map.resolution_m));
  config.alpha = static_cast<float>(options.alpha);
  config.omega = static_cast<float>(options.omega);
  config.prior = static_cast<float>(map.prior);
  config.whole_map = options.whole_map;
  const int least = paper ? 1 : 0;
  if (config.iterations < least || config.iterations > DiffusionConfig::kMostHalo)
    return out_of_range("--iterations", std::to_string(config.iterations),
                        paper ? "1 to 16" : "0 to 16");
  if (!(config.alpha > 0.0F && config.alpha < 1.0F))
    return out_of_range("--alpha", text_of(options.alpha), "a number between 0 and 1");
  if (!(config.omega > 0.0F && config.omega <= 1000.0F))
    return out_of_range("--omega", text_of(options.omega), "a number above 0, at most 1000");
  if (!(config.length_m > 0.0F && config.length_m <= 1e3F))
    return out_of_range("--diffusion-length", text_of(static_cast<double>(config.length_m)),
                        "metres above 0");
  const DiffusionStencil stencil(static_cast<double>(config.length_m) / map.resolution_m);
  if (static_cast<double>(config.length_m) > 9.0 * map.resolution_m ||
      DiffusionBrick::halo_of(config, stencil.reach()) > DiffusionConfig::kMostHalo) {
    return Failure{
        "--diffusion-length times --iterations reaches over 16 voxels; give less of either"};
  }
  return config;
}

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

/// Capacities with which nothing is refused. What is not used is not touched either.
GlobalMapConfig config_for(const std::vector<FuseInput>& inputs, const FuseOptions& options,
                           const DiffusionConfig& diffusion, std::uint32_t segments,
                           std::uint32_t blocks) {
  GlobalMapConfig config;
  config.diffusion = diffusion;
  config.map = inputs.front().stored->map.config();
  config.map.max_evidence = 0.0F;
  const bool paper = diffusion.mode == DiffusionMode::kPaper;
  if (paper) config.map.prior = 0.0;
  const bool all_dense = std::all_of(inputs.begin(), inputs.end(), [](const FuseInput& input) {
    return input.stored->map.config().tuple == TuplePolicy::kDense;
  });
  const std::string counts =
      !options.counts.empty() ? options.counts : (paper || all_dense ? "dense" : "compact");
  config.map.tuple = counts == "dense" ? TuplePolicy::kDense : TuplePolicy::kCompact;
  config.replicas = {.segments = segments,
                     .blocks = blocks,
                     .contributions = static_cast<std::uint32_t>(inputs.size()),
                     .robot_segments = segments};
  // A turned block lies in up to 27 of the grid; its voxels are spread over a third more octets.
  config.blocks = 27 * blocks;
  config.sum_segments = 8 * segments + 27 * blocks;
  config.staged_bytes = 4 * SlabPool::kPageBytes;  // nothing moves
  std::size_t storage = std::size_t{1} << 24U;
  const std::size_t octet_bytes =
      TupleStore::octet_bytes(config.map.tuple, inputs.front().stored->map.num_components());
  for (const FuseInput& input : inputs) {
    const MapFileContent& content = input.stored->header.content;
    storage += 8 * (content.blocks * sizeof(Block) + 4 * content.label_pages * sizeof(LabelPage) +
                    4 * content.free_pages * sizeof(FreePage)) +
               4 * content.octets * octet_bytes;
  }
  config.map.storage_bytes = align_up(storage, SlabPool::kPageBytes);
  return config;
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
      return Failure{"too many maps; give at most " + std::to_string(Replicas::kMostRobots)};
    slots[i] = *slot;
  }
  Status status = Status::kOk;
  for_blocks(inputs, scratch,
             [&](std::size_t input, BlockKey key, std::uint32_t version,
                 std::span<const std::byte> packed) {
               const Result<Replicas::Change> put = global.put(slots[input], key, version, packed);
               if (!put.ok()) status = put.status();
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
  for (const char* const key : {"maps", "out", "report", "transform"}) config.erase(key);
  const Json range = recorded_setting(inputs.front().stored->header, "max_range");
  const bool same = std::all_of(inputs.begin(), inputs.end(), [&](const FuseInput& input) {
    return recorded_setting(input.stored->header, "max_range") == range;
  });
  if (same && !range.is_null()) config["max_range"] = range;
  config["robots"] = Json::array();
  for (const FuseInput& input : inputs) config["robots"].push_back(input.id.robot);
  return config;
}

Outcome<void> run_fuse(const FuseOptions& options) {
  if (options.maps.size() < 2) return Failure{"give at least two local maps to fuse"};
  std::vector<NamedFile> files;
  for (const std::string& path : options.maps) files.push_back({"FILE", path});
  const Outcome<void> places =
      check_outputs({{"--out", options.out}, {"--report", options.report}}, files);
  if (!places.ok()) return places.failure();
  const Outcome<std::vector<FuseInput>> inputs = load_inputs(options.maps, options.transforms);
  if (!inputs.ok()) return inputs.failure();
  const LocalMap& first = inputs->front().stored->map;
  const Outcome<DiffusionConfig> diffusion = diffusion_of(options, first.config());
  if (!diffusion.ok()) return diffusion.failure();

  FuseRun run;
  run.pairs = align_inputs(*inputs);
  std::size_t most_blocks = 0;
  std::uint32_t blocks = 0;
  for (const FuseInput& input : *inputs) {
    most_blocks = std::max(most_blocks, input.stored->map.block_count());
    blocks += static_cast<std::uint32_t>(input.stored->map.block_count());
    run.replica_voxels += static_cast<std::uint32_t>(input.stored->map.usage().label_voxels);
  }
  const int components = first.num_components();
  const std::size_t scratch_bytes = BlockContent::required_bytes(components) +
                                    arena_bytes<std::byte>(most_packed_bytes(components)) +
                                    arena_bytes<KeyedIndex>(2 * most_blocks);
  const Outcome<ArenaMemory> scratch = ArenaMemory::allocate(scratch_bytes);
  if (!scratch.ok()) return scratch.failure();
  std::uint32_t segments = 1;
  Arena counting(scratch->span());
  for_blocks(*inputs, counting,
             [&](std::size_t, BlockKey, std::uint32_t, std::span<const std::byte> packed) {
               segments += SegmentStore::segments_of(packed.size());
             });
  run.config = config_for(*inputs, options, *diffusion, segments, blocks + 1);
  run.arena_bytes = GlobalMap::required_bytes(run.config, components);
  const Outcome<ArenaMemory> memory = ArenaMemory::allocate(run.arena_bytes);
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
  const Json config = to_json(options, run.config);
  MapIdentity identity{.kind = MapKind::kGlobal};
  const Outcome<void> recorded = record_settings(record_of(*inputs, config), identity);
  if (!recorded.ok()) return recorded.failure();
  const Outcome<void> saved = save_map(global->map(), identity, workspace, options.out);
  if (!saved.ok()) return saved.failure();
  print_summary(run, *inputs, options.out);
  return write_report(to_json(run, *inputs, config), options.report);
}

}  // namespace

void add_fuse_command(CLI::App& app, int& exit_status) {
  CLI::App* const command =
      app.add_subcommand("fuse", "Local maps to one global map by label diffusion");
  auto o = std::make_shared<FuseOptions>();
  o->alpha = decimal_of(DiffusionConfig{}.alpha);
  command->add_option("MAPS", o->maps, "Local maps of one resolution and the same classes")
      ->required();
  command->add_option("--out", o->out, "Global map to write")->required();
  command->add_option("--report", o->report, "JSON report to write");
  command
      ->add_option("--transform", o->transforms,
                   "MAP.tsm=T.txt: 4x4 matrix T_global_map, row by row [as the map says]")
      ->allow_extra_args(false);
  command->add_option("--diffusion", o->diffusion, "contractive, paper, or none (the plain sum)")
      ->check(CLI::IsMember({"contractive", "paper", "none"}))
      ->capture_default_str();
  command->add_option("--iterations", o->iterations, "Iterations n [8; paper: 2]")
      ->check(whole_number<int>());
  command
      ->add_option("--diffusion-length", o->length_m,
                   "Length D of its kernel, m [2 voxels; paper: 3]")
      ->check(decimal_number());
  command->add_option("--alpha", o->alpha, "Share that neighbours give, 0 to 1 (contractive)")
      ->check(decimal_number())
      ->capture_default_str();
  command->add_option("--omega", o->omega, "Weight of all evidence")
      ->check(decimal_number())
      ->capture_default_str();
  command->add_option("--edge", o->edge, "Edge term: none, label, similarity or confidence")
      ->check(CLI::IsMember({"none", "label", "similarity", "confidence"}))
      ->capture_default_str();
  command->add_option("--counts", o->counts, "dense or compact counts [as the maps]")
      ->check(CLI::IsMember({"dense", "compact"}));
  command->add_flag("--whole-map", o->whole_map,
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
