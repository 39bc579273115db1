// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Continuing an earlier map: its settings apply, and its content must fit into the budget.
#pragma once

#include <cstddef>

#include "base/outcome.hpp"
#include "scans/dataset.hpp"
#include "settings/map_options.hpp"
#include "tessera/map/map_file.hpp"

namespace tessera {

/// Puts what is fixed for the life of the map options.continue_from into the options. Fails with
/// kUsage iff the map is a global one, has other classes than the dataset, or a given option
/// contradicts it.
Outcome<void> adopt_settings(const MapFileHeader& header, const RecordedScans& source,
                             MapOptions& options);

/// Reads options.continue_from into the map; warns if it was made in another mode. max_points: as
/// given to split_budget. Fails with kUsage if the map is too small; names a sufficient --memory.
Outcome<void> load_earlier(const MapOptions& options, const MapFileHeader& header,
                           const MapSetup& setup, std::size_t max_points, LocalMap& map);

/// Warns if the map was made in another mode than that in which it continues.
void warn_of_another_mode(const MapOptions& options, const MapFileHeader& header,
                          const MapSetup& setup);

}  // namespace tessera
