// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Going on from an earlier map: its settings hold, and its content has to fit into the budget.
#pragma once

#include <cstddef>

#include "dataset/dataset.hpp"
#include "mapping/map_options.hpp"
#include "posix/outcome.hpp"
#include "tessera/map/map_file.hpp"

namespace tessera {

/// Puts the settings of options.continue_from into setup. Fails with kUsage iff the map is a global
/// one, has other classes than the dataset, or a given option contradicts it.
Outcome<void> adopt_settings(const MapOptions& options, const MapFileHeader& header,
                             const RecordedScans& source, MapSetup& setup);

/// Reads options.continue_from into the map; warns if it was made in another mode. max_points: as
/// split_budget had it. Fails with kUsage if the map is too small, saying what --memory is enough.
Outcome<void> load_earlier(const MapOptions& options, const MapFileHeader& header,
                           const MapSetup& setup, std::size_t max_points, LocalMap& map);

/// Warns if the map was made in another mode than it goes on with.
void warn_of_another_mode(const MapOptions& options, const MapFileHeader& header);

}  // namespace tessera
