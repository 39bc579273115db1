// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "maps/fixed_settings.hpp"

#include <algorithm>

#include "base/number_text.hpp"
#include "maps/stored_map.hpp"
#include "settings/class_kernels.hpp"

namespace tessera {

MapOptions held_options(const MapFileHeader& header) {
  MapOptions held;
  held.resolution_m = header.config.resolution_m;
  held.prior = header.config.prior;
  held.max_evidence = decimal_of(header.config.max_evidence);
  held.free_weight = decimal_of(header.config.free_weight);
  held.counts = header.config.tuple;
  held.robot = header.identity.robot;
  return held;
}

void adopt_fixed_settings(const MapFileHeader& header, MapOptions& options) {
  const MapOptions held = held_options(header);
  for (const Setting& row : kMapRows) {
    if (row.fixed) row.member.set(&options, row.member.get(&held));
  }
}

namespace {

/// Whether the classes of a map had the kernels that they have with these. recorded: an object of
/// names with reach and height, null for none; what is of another kind tells nothing.
bool same_kernels(const ClassTable& classes, const Json& recorded,
                  const std::vector<NamedKernel>& now) {
  if (!recorded.is_null() && !recorded.is_object()) return true;
  std::vector<NamedKernel> before;
  for (const auto& [name, lengths] : recorded.items()) {
    if (!lengths.is_array() || lengths.size() != 2 || !lengths[0].is_number() ||
        !lengths[1].is_number())
      return true;
    before.push_back({name, lengths[0].get<double>(), lengths[1].get<double>()});
  }
  const auto table_of = [&classes](const std::vector<NamedKernel>& kernels) {
    const Outcome<ClassTable> table = with_kernels(classes, kernels, "");
    return table.ok() ? *table : classes;
  };
  const ClassTable then_had = table_of(before);
  const ClassTable now_has = table_of(now);
  for (int label = 1; label <= classes.num_classes(); ++label) {
    if (!(then_had.kernel(label) == now_has.kernel(label))) return false;
  }
  return true;
}

Message other_kernels(const std::string& path, const SettingName& setting, bool had_it) {
  const Message remedy = had_it ? "give the same " + Message(setting) + " as it was made with"
                                : "leave out " + Message(setting) + " to keep them";
  return path + " was made with other kernels and continues with those of now; " + remedy;
}

}  // namespace

std::optional<Message> change_of_mode(const std::string& path, const MapFileHeader& header,
                                      const MapOptions& options, const MapSetup& setup) {
  const Json mode = recorded_setting(header, "inference");
  if (!mode.is_string()) return std::nullopt;
  const bool votes = needs_votes(options.inference, header.config.resolution_m);
  const auto is_by_entropies = [](const Json& name) {
    return name == to_string(InferenceMode::kMultiEntropy) ||
           name == to_string(InferenceMode::kLattice);
  };
  // Without votes these two are one.
  if (!votes && is_by_entropies(mode) && is_by_entropies(to_string(options.inference)) &&
      !header.config.label_votes)
    return std::nullopt;
  if (mode != to_string(options.inference))
    return path + " was made with " + kMapSettings["--inference"] + " " + mode.get<std::string>() +
           " and continues with " + to_string(options.inference);
  const std::optional<double> now_m = options.complete().kernel_length_m;
  const Json before_m = recorded_setting(header, "kernel_length");
  if (before_m != (now_m ? Json(*now_m) : Json()))
    return other_kernels(path, kMapSettings["--kernel-length"], !before_m.is_null());
  const Json before = recorded_setting(header, "kernels");
  if (now_m || same_kernels(header.classes, before, setup.kernels)) return std::nullopt;
  return other_kernels(path, kMapSettings["--kernels"], !before.is_null());
}

std::size_t storage_to_continue(const MapFileHeader& header, const MapOptions& options) {
  const std::size_t storage = header.config.storage_bytes;
  const bool votes = needs_votes(options.inference, header.config.resolution_m);
  if (header.config.label_votes || !votes) return storage;
  const MapFileContent& content = header.content;
  const std::uint64_t pages = std::min(content.octets, kBlockLayers * content.label_pages);
  return storage + static_cast<std::size_t>(pages) * sizeof(LabelVotes) + SlabPool::kPageBytes;
}

}  // namespace tessera
