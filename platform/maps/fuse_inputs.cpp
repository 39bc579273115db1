// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "maps/fuse_inputs.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <map>
#include <set>
#include <tuple>

#include "base/number_text.hpp"
#include "maps/submaps.hpp"
#include "scans/transform_file.hpp"
#include "tessera/base/rigid.hpp"
#include "tessera/map/queries.hpp"

namespace tessera {

namespace {

Outcome<void> check_alike(const FuseInput& first, const FuseInput& other) {
  const MapConfig& a = first.stored->map.config();
  const MapConfig& b = other.stored->map.config();
  const auto differ = [&](const char* what, const std::string& of_first,
                          const std::string& of_other) {
    return Failure{other.path + " has " + what + " " + of_other + ", but " + first.path + " has " +
                   of_first + "; give maps that agree"};
  };
  if (a.resolution_m != b.resolution_m)
    return differ("resolution", text_of(a.resolution_m), text_of(b.resolution_m));
  if (!(first.stored->map.classes() == other.stored->map.classes()))
    return Failure{other.path + " has other classes than " + first.path +
                   "; give maps that were made with the same classes"};
  if (a.prior != b.prior) return differ("prior", text_of(a.prior), text_of(b.prior));
  if (a.free_weight != b.free_weight)
    return differ("free weight", text_of(decimal_of(a.free_weight)),
                  text_of(decimal_of(b.free_weight)));
  return {};
}

/// One, or as many as there are submaps.
Outcome<std::vector<FuseInput>> load_input(const std::string& path) {
  // Before the whole file is read.
  TESSERA_TRY_ASSIGN(const MapFileHeader header, load_map_header(path));
  if (header.identity.kind == MapKind::kGlobal)
    return Failure{path + " is a global map; give the local maps that it was made of"};
  if (header.identity.kind == MapKind::kSubmaps) return load_submap_inputs(path, header);
  TESSERA_TRY_ASSIGN(std::unique_ptr<StoredMap> stored, load_map(path));
  TESSERA_TRY_ASSIGN(FuseInput input, to_fuse(path, std::move(stored)));
  std::vector<FuseInput> inputs;
  inputs.push_back(std::move(input));
  return inputs;
}

/// Files of transforms by the path of the map.
Outcome<std::map<std::string, std::string>> parse_transforms(
    const std::vector<std::string>& transforms, const std::vector<std::string>& paths) {
  std::map<std::string, std::string> files;
  for (const std::string& text : transforms) {
    const std::size_t equals = text.rfind('=');
    const std::string path = text.substr(0, equals);
    if (equals == std::string::npos || equals + 1 == text.size())
      return Failure{Message(kTransform) + " " + text + ": give MAP.tsm=T.txt"};
    if (std::find(paths.begin(), paths.end(), path) == paths.end())
      return Failure{Message(kTransform) + " " + text + ": " + path + " is not among the maps"};
    if (!files.emplace(path, text.substr(equals + 1)).second)
      return Failure{Message(kTransform) + " " + text + ": " + path + " already has a transform"};
  }
  return files;
}

/// Gives each map its own robot: a second map of the same robot and epoch gets a number that no map
/// has, with all of its submaps. inputs: sorted by id.
void tell_robots_apart(std::vector<FuseInput>& inputs) {
  std::set<std::uint32_t> robots;
  for (const FuseInput& input : inputs) robots.insert(input.id.robot);
  std::uint32_t last = *robots.rbegin();
  const auto new_number = [&] {
    while (!robots.insert(++last).second) {
    }
    return last;
  };
  using Run = std::pair<std::uint32_t, std::uint32_t>;  // robot and epoch
  std::map<Run, std::string> first;                     // the file that keeps them
  std::map<std::pair<Run, std::string>, std::uint32_t> others;
  std::set<ContributionId> taken;
  for (FuseInput& input : inputs) {
    const Run run{input.id.robot, input.id.epoch};
    if (first.emplace(run, input.path).first->second != input.path) {
      const auto [other, is_new] = others.emplace(std::pair(run, input.path), 0);
      if (is_new) other->second = new_number();
      input.id = {other->second, 0, input.id.submap};
    }
    // In memory maps of one name may be different ones.
    if (!taken.insert(input.id).second) {
      input.id = {new_number(), 0, input.id.submap};
      taken.insert(input.id);
    }
  }
}

/// inputs: sorted by id.
void warn_of_epochs(const std::vector<FuseInput>& inputs, std::vector<Message>& warnings) {
  for (std::size_t i = 1; i < inputs.size(); ++i) {
    const FuseInput& older = inputs[i - 1];
    const FuseInput& newer = inputs[i];
    if (older.id.robot != newer.id.robot || older.id.epoch == newer.id.epoch) continue;
    warnings.push_back(fmt::format(
        "{} is of an earlier epoch of robot {} than {}; it is used only where that has no evidence",
        older.path, older.id.robot, newer.path));
  }
}

}  // namespace

Outcome<std::vector<FuseInput>> load_inputs(const std::vector<std::string>& paths,
                                            const std::vector<std::string>& transforms,
                                            std::vector<Message>& warnings) {
  TESSERA_TRY_ASSIGN(const auto files, parse_transforms(transforms, paths));
  std::vector<FuseInput> inputs;
  for (const std::string& path : paths) {
    if (std::count(paths.begin(), paths.end(), path) > 1)
      return Failure{path + " is named twice; a map's evidence counts once"};
    TESSERA_TRY_ASSIGN(std::vector<FuseInput> of_file, load_input(path));
    for (FuseInput& input : of_file) inputs.push_back(std::move(input));
    if (!of_file.empty()) TESSERA_TRY(check_alike(inputs.front(), inputs.back()));
  }
  for (FuseInput& input : inputs) {
    if (const auto file = files.find(input.path); file != files.end()) {
      TESSERA_TRY_ASSIGN(const Matrix34d T, read_transform(file->second));
      input.T_global_map = T;
      input.placed = true;
    }
  }
  return arrange_inputs(std::move(inputs), warnings);
}

Outcome<std::vector<FuseInput>> load_submap_inputs(const std::string& path,
                                                   const MapFileHeader& header) {
  TESSERA_TRY_ASSIGN(const StoredSubmaps submaps, load_submaps(path, header));
  if (submaps.rows.size() > Replicas::kMostContributions)
    return Failure{
        fmt::format("{} has {} submaps, and at most {} can be put together; map with a "
                    "larger --submap-length",
                    path, submaps.rows.size(), Replicas::kMostContributions)};
  std::vector<FuseInput> inputs;
  for (const SubmapRow& row : submaps.rows) {
    TESSERA_TRY_ASSIGN(std::unique_ptr<StoredMap> stored, load_submap(submaps, row));
    const MapIdentity& identity = header.identity;
    FuseInput input;
    input.path = path;
    input.digest = row.digest;
    input.id = {identity.robot, identity.epoch, row.number};
    input.placed = identity.is_placed();
    input.T_global_map = identity.place();
    input.T_map_submap = *decode_rigid(row.T_map_submap);
    input.stored = std::move(stored);
    inputs.push_back(std::move(input));
  }
  return inputs;
}

Outcome<FuseInput> to_fuse(std::string name, std::shared_ptr<const StoredMap> stored) {
  const MapIdentity& identity = stored->header.identity;
  if (identity.kind == MapKind::kGlobal)
    return Failure{name + " is a global map; give the local maps that it was made of"};
  FuseInput input;
  input.path = std::move(name);
  std::vector<KeyedIndex> workspace = workspace_for(stored->map);
  input.digest = digest(stored->map, workspace);
  input.id = {identity.robot, identity.epoch, 0};
  input.placed = identity.is_placed();
  input.T_global_map = identity.place();
  input.stored = std::move(stored);
  return input;
}

Outcome<std::vector<FuseInput>> arrange_inputs(std::vector<FuseInput> inputs,
                                               std::vector<Message>& warnings) {
  for (FuseInput& input : inputs) {
    TESSERA_TRY(check_alike(inputs.front(), input));
    const double resolution_m = input.stored->map.config().resolution_m;
    const Result<GridTransform> frame =
        GridTransform::make(product(input.T_global_map, input.T_map_submap), resolution_m);
    if (!frame.ok())
      return Failure{input.path + ": its transform puts it outside of the grid; fix the transform"};
    input.frame = *frame;
  }
  std::sort(inputs.begin(), inputs.end(), [](const FuseInput& a, const FuseInput& b) {
    return std::tie(a.id, a.digest, a.path) < std::tie(b.id, b.digest, b.path);
  });
  warn_of_epochs(inputs, warnings);
  tell_robots_apart(inputs);
  return inputs;
}

void warn_of_no_frame(const std::vector<FuseInput>& inputs, std::vector<Message>& warnings) {
  const auto placed = [](const FuseInput& input) { return input.placed; };
  if (std::any_of(inputs.begin(), inputs.end(), placed)) {
    for (const FuseInput& input : inputs) {
      if (!input.placed)
        warnings.push_back(input.path +
                           " has no T_global_map; its frame is taken for the global one");
    }
    return;
  }
  warnings.push_back(
      fmt::format("none of the {} maps has a T_global_map: their frames are taken for the same "
                  "one; where they are not, have them found (",
                  inputs.size()) +
      Message(kAlign) + "), or give " + Message(kTransform) +
      Message(" MAP.tsm=T.txt for each", ", one for each"));
}

std::vector<NamedFile> files_of(const std::vector<std::string>& paths,
                                const std::vector<std::string>& transforms, const char* option) {
  std::vector<NamedFile> files;
  for (const std::string& path : paths) files.push_back({option, path});
  for (const std::string& text : transforms) {
    if (const std::size_t equals = text.rfind('='); equals != std::string::npos)
      files.push_back({kTransform, text.substr(equals + 1)});
  }
  return files;
}

}  // namespace tessera
