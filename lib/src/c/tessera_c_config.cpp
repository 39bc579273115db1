// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Settings from C and their defaults.
#include "tessera/base/version.hpp"
#include "tessera_c.hpp"

namespace tessera::c_interface {

namespace {

/// Calls visit on each setting of C and what it is of the core.
template <class Visit>
void for_fields_of_map(tessera_config& c, RobotConfig& core, Visit&& visit) noexcept {
  visit(c.resolution_m, core.map.resolution_m);
  visit(c.prior, core.map.prior);
  visit(c.local_bytes, core.map.storage_bytes);
  visit(c.global_bytes, core.global.map.storage_bytes);
  visit(c.max_evidence, core.map.max_evidence);
  visit(c.free_weight, core.map.free_weight);
  visit(c.local_tuple, core.map.tuple);
  visit(c.global_tuple, core.global.map.tuple);
  visit(c.scan_points, core.scan.points);
  visit(c.scan_tiles, core.scan.tiles);
  visit(c.scan_ray_blocks, core.scan.ray_blocks);
  visit(c.hash_seed, core.map.hash_seed);
  visit(c.archived_blocks, core.archived_blocks);
}

template <class Visit>
void for_fields_of_inference(tessera_config& c, RobotConfig& core, Visit&& visit) noexcept {
  InferenceConfig& inference = core.inference;
  visit(c.mode, inference.mode);
  visit(c.thinning_m, inference.thinning_m);
  visit(c.min_range_m, inference.min_range_m);
  visit(c.max_range_m, inference.max_range_m);
  visit(c.no_return_range_m, inference.no_return_range_m);
  visit(c.thinning_weight, inference.thinning_weight);
  visit(c.free_space, inference.free_space.enabled);
  visit(c.carving, inference.free_space.carving);
  visit(c.neighbour_pixels, inference.free_space.neighbour_pixels);
  visit(c.neighbour_angle_rad, inference.free_space.neighbour_angle_rad);
  visit(c.margin_voxels, inference.free_space.margin_voxels);
  visit(c.kernel_length_m, inference.kernel_length_m);
  visit(c.kernel_scale, inference.kernel_scale);
  visit(c.min_weight, inference.min_weight);
  visit(c.base_length, inference.entropy.base_length);
  visit(c.entropy_length, inference.entropy.entropy_length);
  visit(c.smooth_above, inference.entropy.smooth_above);
  visit(c.fill_length, inference.entropy.fill_length);
  visit(c.fill_neighbours, inference.entropy.fill_neighbours);
  visit(c.fill_one_label, inference.entropy.fill_one_label);
  visit(c.block_edge, inference.entropy.block_edge);
  visit(c.lattice_reach_m, inference.lattice.reach_m);
  visit(c.lattice_height_m, inference.lattice.height_m);
  visit(c.work_budget, inference.work_budget);
  visit(c.deadline_us, core.deadline_us);
}

template <class Visit>
void for_fields_of_body(tessera_config& c, RobotConfig& core, Visit&& visit) noexcept {
  RobotBody& body = core.inference.body;
  static_assert(RobotBody::kMostBoxes == TESSERA_MOST_BODY_BOXES);
  visit(c.body_boxes, body.count);
  for (std::size_t i = 0; i < RobotBody::kMostBoxes; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      visit(c.body[i][k], body.boxes[i].low[k]);
      visit(c.body[i][3 + k], body.boxes[i].high[k]);
    }
  }
}

template <class Visit>
void for_fields_of_sharing(tessera_config& c, RobotConfig& core, Visit&& visit) noexcept {
  visit(c.publisher_blocks, core.publisher.blocks);
  visit(c.publisher_candidates, core.publisher.candidates);
  visit(c.staleness_us, core.publisher.staleness_us);
  visit(c.free_staleness_us, core.publisher.free_staleness_us);
  visit(c.retry_us, core.publisher.retry_us);
  visit(c.evidence_factor, core.publisher.evidence_factor);
  visit(c.few_voxels, core.publisher.few_voxels);
  visit(c.many_voxels, core.publisher.many_voxels);
  visit(c.near_blocks, core.publisher.near_blocks);
  visit(c.tick_entries, core.budget.entries);
  visit(c.tick_compared, core.budget.compared);
  visit(c.tick_label_bytes, core.budget.label_bytes);
  visit(c.tick_free_bytes, core.budget.free_bytes);
  visit(c.submap_length_m, core.submap_cuts.length_m);
  visit(c.submap_ticks, core.submap_ticks);
  visit(c.most_submaps, core.most_submaps);
  visit(c.first_submap, core.first_submap);
  visit(c.submap_time_us, core.submap_cuts.time_us);
  visit(c.submap_jump_m, core.submap_cuts.jump_m);
  visit(c.reach_m, core.reach_m);
  visit(c.objections, core.objections);
  visit(c.teammate_margin_m, core.teammate_margin_m);
  visit(c.far_contributions, core.exchange.far_contributions);
  visit(c.contributions, core.exchange.contributions);
  visit(c.own_contributions, core.exchange.own_contributions);
  visit(c.peers, core.exchange.peers);
  visit(c.answers, core.exchange.answers);
  visit(c.fresh, core.exchange.fresh);
  visit(c.bytes_per_s, core.exchange.bytes_per_s);
  visit(c.burst_bytes, core.exchange.burst_bytes);
  visit(c.announce_us, core.exchange.announce_us);
  visit(c.announce_soon_us, core.exchange.announce_soon_us);
  visit(c.request_us, core.exchange.request_us);
  visit(c.request_most_us, core.exchange.request_most_us);
  visit(c.request_idle_us, core.exchange.request_idle_us);
  visit(c.answer_us, core.exchange.answer_us);
  visit(c.mission, core.exchange.mission);
  visit(c.contributions_per_robot, core.exchange.contributions_per_robot);
  visit(c.picks, core.exchange.picks);
  visit(c.listen_us, core.exchange.listen_us);
  visit(c.frame_us, core.exchange.frame_us);
  visit(c.conflicts, core.exchange.conflicts);
}

template <class Visit>
void for_fields_of_global(tessera_config& c, RobotConfig& core, Visit&& visit) noexcept {
  GlobalMapConfig& global = core.global;
  visit(c.staged_bytes, global.staged_bytes);
  visit(c.global_blocks, global.blocks);
  visit(c.sum_segments, global.sum_segments);
  visit(c.replica_segments, global.replicas.segments);
  visit(c.replica_blocks, global.replicas.blocks);
  visit(c.robot_segments, global.replicas.robot_segments);
  visit(c.robot_blocks, global.replicas.robot_blocks);
  visit(c.work_per_tick, core.work_per_tick);
  visit(c.near_first, core.near_first);
  visit(c.diffusion, global.diffusion.mode);
  visit(c.edge, global.diffusion.edge);
  visit(c.iterations, global.diffusion.iterations);
  visit(c.length_m, global.diffusion.length_m);
  visit(c.alpha, global.diffusion.alpha);
  visit(c.omega, global.diffusion.omega);
  visit(c.diffusion_prior, global.diffusion.prior);
  visit(c.whole_map, global.diffusion.whole_map);
  visit(c.weigh_robots, global.diffusion.weigh_robots);
  visit(c.reliability_alarm, global.diffusion.reliability_alarm);
  visit(c.frames, core.frames.mode);
  visit(c.frame_robots, core.frames.most_robots);
  visit(c.frame_sigma_m, core.frames.sigma_m);
  visit(c.frame_sigma_rad, core.frames.sigma_rad);
}

template <class Visit>
void for_fields(tessera_config& c, RobotConfig& core, Visit&& visit) noexcept {
  visit(c.robot, core.exchange.robot);
  visit(c.epoch, core.epoch);
  for_fields_of_map(c, core, visit);
  for_fields_of_inference(c, core, visit);
  for_fields_of_body(c, core, visit);
  for_fields_of_sharing(c, core, visit);
  for_fields_of_global(c, core, visit);
}

/// Enumerations are small: what does not fit one would be taken for another.
bool are_kinds(const tessera_config& c) noexcept {
  return c.local_tuple <= TESSERA_COMPACT && c.global_tuple <= TESSERA_COMPACT &&
         c.mode <= TESSERA_LATTICE && c.thinning_weight <= TESSERA_THINNING_SUM &&
         c.diffusion <= TESSERA_NO_DIFFUSION && c.edge <= TESSERA_EDGE_CONFIDENCE &&
         c.carving <= TESSERA_CARVING_IMAGE && c.neighbour_pixels <= CarveImage::kMostNeighbours &&
         c.free_space <= 1 && c.fill_one_label <= 1 && c.near_first <= 1 && c.whole_map <= 1 &&
         c.weigh_robots <= 1 && c.fill_neighbours <= 7 && c.block_edge <= 4 && c.conflicts <= 1 &&
         c.reserved == 0 && c.body_boxes <= TESSERA_MOST_BODY_BOXES && c.reserved_2 == 0 &&
         c.reserved_3 == 0 && c.frames <= TESSERA_FRAMES_FOUND;
}

/// What required_bytes can compute with.
bool are_sizes(const RobotConfig& config) noexcept {
  const DiffusionConfig& diffusion = config.global.diffusion;
  const auto is_storage = [](std::size_t bytes) {
    return bytes >= 4 * SlabPool::kPageBytes && bytes <= MapConfig::kMaxStorageBytes;
  };
  return in_range(config.map) && in_range(config.global.map) &&
         is_storage(config.map.storage_bytes) && is_storage(config.global.map.storage_bytes) &&
         is_storage(config.global.staged_bytes) && config.scan.points >= 1 &&
         config.scan.points <= ScanCapacity::kMaxPoints && config.scan.tiles >= 1 &&
         config.scan.ray_blocks >= 1 && config.publisher.blocks >= 1 &&
         config.objections <= Objection::kPlaces && config.teammate_margin_m >= 0.0 &&
         config.teammate_margin_m <= 2.0 && config.publisher.blocks <= (1U << 28U) &&
         diffusion.iterations >= 0 && diffusion.iterations <= DiffusionConfig::kMostHalo &&
         diffusion.length_m > 0.0F && diffusion.length_m <= 1e6F &&
         diffusion.reliability_alarm >= 0.0F && diffusion.reliability_alarm <= 1.0F &&
         config.deadline_us >= 0 && is_time(config.deadline_us) && is_valid(config.frames);
}

/// False: it is out of its range.
bool read_window(const tessera_config& c, RobotConfig& into) noexcept {
  if (!(c.window_radius_m != 0.0)) return true;
  WindowConfig& window = into.window.emplace();
  window.radius_m = c.window_radius_m;
  window.hysteresis_m = c.window_hysteresis_m;
  constexpr std::uint32_t kMostBlocks = 1U << 28U;
  return MovingWindow::make(window, c.resolution_m).ok() && c.archived_blocks >= 1 &&
         c.archived_blocks <= kMostBlocks;
}

tessera_config defaults() noexcept {
  tessera_config c{};
  RobotConfig core;
  const auto to_c = []<class To, class From>(To& to, const From& from) {
    to = static_cast<To>(from);
  };
  for_fields(c, core, to_c);
  c.session = static_cast<std::uint32_t>(core.exchange.session >> 32U);
  c.window_hysteresis_m = WindowConfig{}.hysteresis_m;
  c.struct_bytes = sizeof(tessera_config);
  return c;
}

}  // namespace

Status read_config(const tessera_config* from, RobotConfig& into) noexcept {
  tessera_config c = defaults();
  const Status status = read_struct(from, TESSERA_CONFIG_LEAST_BYTES, c);
  if (status != Status::kOk) return status;
  if (!are_kinds(c)) return Status::kInvalidArgument;
  const auto to_core = []<class From, class To>(const From& value, To& to) {
    to = static_cast<To>(value);
  };
  for_fields(c, into, to_core);
  if (!read_window(c, into)) return Status::kInvalidArgument;
  into.exchange.session = std::uint64_t{c.session} << 32U | c.session_random;
  MapConfig& global = into.global.map;
  global.resolution_m = into.exchange.resolution_m = into.map.resolution_m;
  global.prior = into.exchange.prior = into.map.prior;
  global.free_weight = into.exchange.free_weight = into.map.free_weight;
  global.max_evidence = 0.0F;
  global.hash_seed = into.map.hash_seed;
  into.global.max_evidence = into.map.max_evidence;
  into.exchange.max_evidence = robot_max_evidence(into.map);
  into.exchange.records = into.global.replicas.blocks;
  into.global.replicas.contributions = into.exchange.contributions;
  into.map.label_votes = needs_votes(into.inference.mode, into.map.resolution_m);
  if (into.inference.mode == InferenceMode::kCounting)
    into.map.probabilities = global.probabilities = Probabilities::kShares;
  // As eq. (10) has it: the prior is in what is summed up.
  if (into.global.diffusion.mode == DiffusionMode::kPaper) global.prior = 0.0;
  return are_sizes(into) ? Status::kOk : Status::kInvalidArgument;
}

Status read_kernels(const tessera_config* from, ClassTable& into) noexcept {
  tessera_config c = defaults();
  Status status = read_struct(from, TESSERA_CONFIG_LEAST_BYTES, c);
  for (int label = 1; status == Status::kOk && label <= into.num_classes(); ++label) {
    const ClassKernel kernel{c.class_reach_m[label - 1], c.class_height_m[label - 1]};
    const bool by_name = kernel.reach_m == 0.0F && kernel.height_m == 0.0F;
    if (!by_name) status = into.set_kernel(label, kernel);
  }
  return status;
}

}  // namespace tessera::c_interface

using namespace tessera;
using namespace tessera::c_interface;

// NOLINTBEGIN(readability-identifier-naming): names of a C interface
extern "C" {

uint32_t tessera_api_version(void) { return TESSERA_API_VERSION; }
uint32_t tessera_abi_version(void) { return TESSERA_ABI_VERSION; }
const char* tessera_version(void) { return kVersion; }

const char* tessera_status_text(uint32_t status) {
  return status <= TESSERA_BUSY ? to_string(static_cast<Status>(status)) : "unknown status";
}

tessera_status tessera_config_init(tessera_config* config, uint32_t struct_bytes) {
  if (config == nullptr || struct_bytes < TESSERA_CONFIG_LEAST_BYTES || !is_whole(struct_bytes))
    return TESSERA_INVALID_ARGUMENT;
  if (struct_bytes > sizeof(tessera_config)) return TESSERA_UNSUPPORTED;
  tessera_config c = defaults();
  c.struct_bytes = struct_bytes;
  std::memcpy(config, &c, struct_bytes);
  return TESSERA_OK;
}

tessera_status tessera_required_bytes(const tessera_config* config, uint32_t num_classes,
                                      uint64_t* bytes) {
  if (bytes == nullptr || num_classes < 1 || num_classes > TESSERA_MOST_CLASSES)
    return TESSERA_INVALID_ARGUMENT;
  RobotConfig core;
  const Status status = read_config(config, core);
  if (status != Status::kOk) return status_of(status);
  const int components = static_cast<int>(num_classes) + 2;
  *bytes = arena_bytes<tessera_robot>(1) + Robot::required_bytes(core, components) +
           arena_bytes<std::uint64_t>(workspace_words(components)) +
           archive_bytes(core, components);
  return TESSERA_OK;
}

}  // extern "C"
// NOLINTEND(readability-identifier-naming)
