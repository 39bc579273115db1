// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "maps/fixed_settings.hpp"

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
                                      const MapOptions& options) {
  const Json mode = recorded_setting(header, "inference");
  if (!mode.is_string() || mode == to_string(options.inference)) return std::nullopt;
  return path + " was made with " + kMapSettings["--inference"] + " " + mode.get<std::string>() +
         " and continues with " + to_string(options.inference);
}

}  // namespace tessera
