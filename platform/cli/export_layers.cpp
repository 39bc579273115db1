// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/export_layers.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <span>

#include "base/number_text.hpp"
#include "cli/command.hpp"
#include "cli/contributors.hpp"
#include "cli/moved_layer.hpp"
#include "maps/session_file.hpp"

namespace tessera {

namespace {

/// Colour of occupied voxels without a label.
constexpr Color kNoLabel{128, 128, 128};

/// Distinguishable with every kind of colour vision, after Okabe and Ito. Voxels of several robots
/// are dark, so that their extent is seen first.
constexpr std::array<Color, 8> kRobots{
    Color{86, 180, 233}, Color{230, 159, 0}, Color{0, 158, 115}, Color{204, 121, 167},
    Color{240, 228, 66}, Color{0, 114, 178}, Color{213, 94, 0},  Color{164, 206, 149}};
constexpr Color kOtherRobots{176, 152, 126};
constexpr Color kTwoRobots{92, 84, 128};
constexpr Color kMoreRobots{40, 36, 62};

constexpr Color kAgree{0, 114, 178};
constexpr Color kDisagree{213, 94, 0};
constexpr Color kNobody{240, 228, 66};
constexpr Color kOneRobot{158, 162, 170};

/// From certain to uncertain.
constexpr std::array<Color, 8> kScale = kColorScale;
/// Where one colour ends and the next begins.
struct Scale {
  const char* name = "";
  float PlyVoxel::*value = nullptr;
  std::array<float, kScale.size() - 1> limits{};
  bool rising = true;  ///< True if larger values are less certain.
};
constexpr Scale kVariance{
    "variance", &PlyVoxel::variance, {0.001F, 0.002F, 0.005F, 0.01F, 0.02F, 0.05F, 0.1F}, true};
constexpr Scale kProbability{
    "probability", &PlyVoxel::probability, {0.99F, 0.95F, 0.9F, 0.8F, 0.7F, 0.6F, 0.5F}, false};

bool is_of_robots(const LayerOptions& options) {
  return options.show == "contributors" || options.show == "disagreement";
}

/// Legend entries with the share of voxels that have their colour.
class Tally {
 public:
  explicit Tally(std::size_t all) : all_(all) {}
  void add(const std::string& name, Color color, std::uint64_t count) {
    const double share = static_cast<double>(count) / static_cast<double>(all_ == 0 ? 1 : all_);
    entries_.push_back({name + " " + text_of(std::round(1000.0 * share) / 10.0) + " %", color});
  }
  [[nodiscard]] std::vector<LegendEntry> take() { return std::move(entries_); }

 private:
  std::size_t all_;
  std::vector<LegendEntry> entries_;
};

Layer color_by_class(const ClassTable& classes, std::vector<PlyVoxel>& voxels) {
  Layer layer;
  for (PlyVoxel& voxel : voxels)
    voxel.color = voxel.label == 0 ? kNoLabel : classes[voxel.label].color;
  for (int label = 1; label <= classes.num_classes(); ++label)
    layer.legend.push_back({std::string(classes[label].name_view()), classes[label].color});
  layer.legend.push_back({"no label", kNoLabel});
  return layer;
}

std::size_t step_of(const Scale& scale, float value) {
  return static_cast<std::size_t>(
      std::count_if(scale.limits.begin(), scale.limits.end(),
                    [&](float limit) { return scale.rising ? value > limit : value < limit; }));
}

std::string name_of(const Scale& scale, std::size_t step) {
  const auto limit = [&](std::size_t i) { return text_of(decimal_of(scale.limits[i])); };
  if (step == 0) return scale.name + std::string(scale.rising ? " up to " : " from ") + limit(0);
  if (step == scale.limits.size()) return (scale.rising ? "over " : "under ") + limit(step - 1);
  return limit(step - 1) + " to " + limit(step);
}

Layer color_by_certainty(const Scale& scale, std::vector<PlyVoxel>& voxels) {
  std::array<std::uint64_t, kScale.size()> counts{};
  std::uint64_t unlabelled = 0;
  for (PlyVoxel& voxel : voxels) {
    const std::size_t step = step_of(scale, voxel.*scale.value);
    voxel.color = voxel.label == 0 ? kNoLabel : kScale[step];
    ++(voxel.label == 0 ? unlabelled : counts[step]);
  }
  Tally tally(voxels.size());
  for (std::size_t step = 0; step < kScale.size(); ++step)
    tally.add(name_of(scale, step) + ":", kScale[step], counts[step]);
  tally.add("no label:", kNoLabel, unlabelled);
  return {tally.take(), Json::object()};
}

Color color_of_robots(std::uint64_t robots) {
  switch (std::popcount(robots)) {
    case 0:
      return kNoLabel;
    case 1: {
      const auto robot = static_cast<std::size_t>(std::countr_zero(robots));
      return robot < kRobots.size() ? kRobots[robot] : kOtherRobots;
    }
    case 2:
      return kTwoRobots;
    default:
      return kMoreRobots;
  }
}

std::vector<LegendEntry> color_by_contributors(const Contributors& contributors,
                                               std::vector<PlyVoxel>& voxels) {
  std::vector<std::uint64_t> alone(contributors.all.size());
  std::array<std::uint64_t, 4> by_number{};
  for (std::size_t i = 0; i < voxels.size(); ++i) {
    const std::uint64_t robots = contributors.voxels[i].from;
    voxels[i].color = color_of_robots(robots);
    const auto number = static_cast<std::size_t>(std::popcount(robots));
    ++by_number[std::min<std::size_t>(number, 3)];
    if (number == 1) ++alone[static_cast<std::size_t>(std::countr_zero(robots))];
  }
  Tally tally(voxels.size());
  std::uint64_t others = 0;
  for (std::size_t i = 0; i < alone.size(); ++i) {
    if (i < kRobots.size()) {
      tally.add("only " + contributors.all[i].maps + ":", kRobots[i], alone[i]);
    } else {
      others += alone[i];
    }
  }
  tally.add("only one of the others:", kOtherRobots, others);
  tally.add("two " + contributors.plural + ":", kTwoRobots, by_number[2]);
  tally.add("three or more:", kMoreRobots, by_number[3]);
  tally.add("label of no " + contributors.noun + ":", kNoLabel, by_number[0]);
  return tally.take();
}

std::vector<LegendEntry> color_by_disagreement(const Contributors& contributors,
                                               std::vector<PlyVoxel>& voxels) {
  struct Kind {
    std::string name;
    Color color{};
    std::uint64_t voxels = 0;
  };
  const std::string& noun = contributors.noun;
  std::array<Kind, 4> kinds{Kind{contributors.plural + " agree:", kAgree},
                            Kind{contributors.plural + " disagree:", kDisagree},
                            Kind{"one " + noun + " only:", kOneRobot},
                            Kind{"label of no " + noun + ":", kNobody}};
  for (std::size_t i = 0; i < voxels.size(); ++i) {
    const VoxelLabels& labels = contributors.voxels[i];
    const int robots = std::popcount(labels.from);
    Kind& kind = kinds[robots == 0 ? 3U : (robots == 1 ? 2U : (labels.differ ? 1U : 0U))];
    voxels[i].color = kind.color;
    ++kind.voxels;
  }
  Tally tally(voxels.size());
  for (const Kind& kind : kinds)
    tally.add(kind.name + " " + counted(kind.voxels, "voxel") + ",", kind.color, kind.voxels);
  return tally.take();
}

Json counts_of(const Contributors& contributors, const std::vector<FuseInput>& inputs) {
  Json json;
  json["contributors"] = Json::array();
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    const FuseInput& input = inputs[i];
    Json one = {{"map", input.path}, {"voxels", contributors.of_maps[i]}};
    if (input.session) {
      one["session"] = to_json(*input.session);
    } else {
      one["robot"] = input.id.robot;
    }
    json["contributors"].push_back(std::move(one));
  }
  std::uint64_t shared = 0;
  std::uint64_t disagreeing = 0;
  std::uint64_t unexplained = 0;
  for (const VoxelLabels& voxel : contributors.voxels) {
    shared += std::popcount(voxel.from) > 1 ? 1U : 0U;
    disagreeing += voxel.differ ? 1U : 0U;
    unexplained += voxel.from == 0 ? 1U : 0U;
  }
  json["shared_voxels"] = shared;
  json["disagreeing_voxels"] = disagreeing;
  json["no_robot_voxels"] = unexplained;
  return json;
}

Outcome<void> check_alike(const StoredMap& global, const std::string& path,
                          const FuseInput& input) {
  if (global.header.identity.kind != MapKind::kGlobal)
    return Failure{path +
                   " is a local map, made by one robot; give a global map, or leave --show "
                   "and --of out"};
  const MapConfig& own = global.map.config();
  const MapConfig& other = input.stored->map.config();
  if (own.resolution_m != other.resolution_m) {
    return Failure{"--of " + input.path + " has resolution " + text_of(other.resolution_m) +
                   ", but " + path + " has " + text_of(own.resolution_m) +
                   "; give the maps that it was made of"};
  }
  if (!(global.map.classes() == input.stored->map.classes())) {
    return Failure{"--of " + input.path + " has other classes than " + path +
                   "; give the maps that it was made of"};
  }
  return {};
}

/// Warns if the map was made of other maps, of more, or with other transforms.
void warn_of_others(const Contributors& contributors, const std::vector<PlyVoxel>& voxels) {
  std::uint64_t unexplained = 0;
  for (std::size_t i = 0; i < voxels.size(); ++i)
    unexplained += voxels[i].label != 0 && contributors.voxels[i].from == 0 ? 1U : 0U;
  if (unexplained == 0) return;
  warn(counted(unexplained, "voxel") +
       " with a label that none of the maps of --of has there; give all maps that the global map "
       "was made of, its sessions, and their transforms");
}

Outcome<Layer> color_by_robots(const LayerOptions& options, const StoredMap& map,
                               const std::string& path, ExportedVoxels& exported) {
  std::vector<Message> warnings;
  const Outcome<std::vector<FuseInput>> inputs =
      load_contributors(options.of, options.sessions, options.transforms, warnings);
  for (const Message& warning : warnings) warn(warning);
  if (!inputs.ok()) return inputs.failure();
  TESSERA_TRY(check_alike(map, path, inputs->front()));
  const Contributors contributors = find_contributors(*inputs, exported.places);
  for (std::size_t i = 0; i < exported.voxels.size(); ++i)
    exported.voxels[i].robots =
        static_cast<std::uint8_t>(std::popcount(contributors.voxels[i].from));
  warn_of_others(contributors, exported.voxels);
  Layer layer;
  layer.legend = *options.show == "contributors"
                     ? color_by_contributors(contributors, exported.voxels)
                     : color_by_disagreement(contributors, exported.voxels);
  layer.counts = counts_of(contributors, *inputs);
  return layer;
}

}  // namespace

void ExportedVoxels::add(const Lattice& lattice, const VoxelCoord& place,
                         const Estimate& estimate) {
  const Point3f p_map = round_to_float(lattice.center_of(place));
  places.push_back(place);
  voxels.push_back({.x = p_map.x(),
                    .y = p_map.y(),
                    .z = p_map.z(),
                    .color = {},
                    .label = static_cast<std::uint8_t>(estimate.label),
                    .probability = static_cast<float>(estimate.probability),
                    .variance = static_cast<float>(estimate.variance),
                    .evidence = static_cast<float>(estimate.evidence),
                    .is_free = estimate.state == VoxelState::kFree});
}

Outcome<void> check_layer(const LayerOptions& options) {
  if (is_of_robots(options) && options.of.empty()) {
    return Failure{"--show " + *options.show +
                   " needs the local maps that the global map was made of; name them with --of"};
  }
  if (is_of_robots(options)) return {};
  const char* const extra = !options.of.empty()           ? "--of"
                            : !options.sessions.empty()   ? "--session"
                            : !options.transforms.empty() ? "--transform"
                                                          : nullptr;
  if (extra == nullptr) return {};
  return Failure{std::string(extra) +
                 " goes with --show contributors or disagreement only; choose one of these, or "
                 "leave it out"};
}

Outcome<Layer> color_voxels(const LayerOptions& options, const Coloring& coloring,
                            const StoredMap& map, const std::string& path,
                            ExportedVoxels& exported) {
  if (is_of_robots(options)) return color_by_robots(options, map, path, exported);
  if (coloring.show == "height")
    return Layer{color_by_height(coloring.heights, exported.voxels), Json::object()};
  if (coloring.show == "class") return color_by_class(map.map.classes(), exported.voxels);
  if (coloring.show == "moved") return color_by_what_moved(map.map.classes(), exported.voxels);
  return color_by_certainty(coloring.show == "variance" ? kVariance : kProbability,
                            exported.voxels);
}

}  // namespace tessera
