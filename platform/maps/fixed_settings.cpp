// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "maps/fixed_settings.hpp"

#include <algorithm>

#include "base/number_text.hpp"
#include "maps/stored_map.hpp"

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

std::optional<Message> change_of_mode(const std::string& path, const MapFileHeader& header,
                                      const MapOptions& options, const MapSetup& setup) {
  const Json mode = recorded_setting(header, "inference");
  if (!mode.is_string()) return std::nullopt;
  if (mode != to_string(options.inference))
    return path + " was made with " + kMapSettings["--inference"] + " " + mode.get<std::string>() +
           " and continues with " + to_string(options.inference);
  const Json now = settings_of(to_json(options, setup));
  for (const char* const option : {"--kernel-length", "--kernels"}) {
    const char* const key = option == std::string("--kernels") ? "kernels" : "kernel_length";
    if (recorded_setting(header, key) == (now.contains(key) ? now[key] : Json())) continue;
    return path + " was made with other kernels and continues with those of now; give the same " +
           option + " as it was made with";
  }
  return std::nullopt;
}

std::size_t storage_to_continue(const MapFileHeader& header, const MapOptions& options) {
  const std::size_t storage = header.config.storage_bytes;
  if (!needs_votes(options.inference)) return storage;
  const MapFileContent& content = header.content;
  const std::uint64_t pages = std::min(content.octets, kBlockLayers * content.label_pages);
  return storage + static_cast<std::size_t>(pages) * sizeof(LabelVotes) + SlabPool::kPageBytes;
}

}  // namespace tessera
