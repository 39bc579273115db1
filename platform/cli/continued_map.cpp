// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/continued_map.hpp"

#include <cmath>

#include "cli/command.hpp"
#include "maps/fixed_settings.hpp"
#include "maps/stored_map.hpp"

namespace tessera {

namespace {

/// Fails iff the value is given and is another one. held: as the file has it.
Outcome<void> check_fixed(const std::string& path, const Setting& setting, const MapOptions& given,
                          const MapOptions& held) {
  const SettingValue value = setting.member.get(&given);
  const SettingValue kept = setting.member.get(&held);
  if (std::holds_alternative<std::monostate>(value) || value == kept) return {};
  const auto* const x = std::get_if<double>(&value);
  const auto* const y = std::get_if<double>(&kept);
  // The file keeps some of them as floats.
  if (x != nullptr && y != nullptr && std::abs(*x - *y) <= 1e-6 * *y) return {};
  return Failure{path + " was made with " + setting.name + " " + text_of(setting, kept) +
                 "; leave " + setting.name + " out or give the same"};
}

}  // namespace

void warn_of_another_mode(const MapOptions& options, const MapFileHeader& header,
                          const MapSetup& setup) {
  if (const auto warning = change_of_mode(options.continue_from, header, options, setup))
    warn(*warning);
}

Outcome<void> adopt_settings(const MapFileHeader& header, const RecordedScans& source,
                             MapOptions& options) {
  const std::string& path = options.continue_from;
  if (header.identity.kind == MapKind::kSubmaps)
    return Failure{path + " is in submaps and cannot be continued; give a map in one piece"};
  if (header.identity.kind != MapKind::kLocal)
    return Failure{path + " is a global map; continue a robot's local map"};
  const MapOptions held = held_options(header);
  for (const Setting& row : kMapRows) {
    if (row.fixed) TESSERA_TRY(check_fixed(path, row, options, held));
  }
  adopt_fixed_settings(header, options);
  if (header.classes == source.classes().table()) return {};
  return Failure{path + " has other classes than " + options.folder() +
                 "; use data with the same classes"};
}

Outcome<void> load_earlier(const MapOptions& options, const MapFileHeader& header,
                           const MapSetup& setup, std::size_t max_points, LocalMap& map) {
  TESSERA_TRY_ASSIGN(const bool loaded, load_into(options.continue_from, map));
  if (!loaded) {
    const std::size_t enough =
        budget_for_storage(setup, max_points, storage_to_continue(header, options));
    const SettingName& memory = kMapSettings["--memory"];
    return Failure{Message(memory) + " " + bytes_text(options.memory_bytes) +
                   " is too small for the map " + options.continue_from + "; give a larger " +
                   memory + ", at least " + bytes_text(enough)};
  }
  warn_of_another_mode(options, header, setup);
  return {};
}

}  // namespace tessera
