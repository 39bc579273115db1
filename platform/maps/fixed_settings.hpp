// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Continuing a map file: the settings that it fixes, for the command and for Python.
#pragma once

#include <optional>
#include <string>

#include "base/message.hpp"
#include "settings/map_options.hpp"
#include "tessera/map/map_file.hpp"

namespace tessera {

/// The settings that are fixed for the life of a map, as its header has them; all others are as by
/// default.
[[nodiscard]] MapOptions held_options(const MapFileHeader& header);

/// Sets those of options.
void adopt_fixed_settings(const MapFileHeader& header, MapOptions& options);

/// A warning iff the map of the file was made in another mode than that of options, or with other
/// kernels. setup: of these options.
[[nodiscard]] std::optional<Message> change_of_mode(const std::string& path,
                                                    const MapFileHeader& header,
                                                    const MapOptions& options,
                                                    const MapSetup& setup);

/// Storage that the content of a map file needs, at least, where options continue it: votes make
/// more of it than the file has.
[[nodiscard]] std::size_t storage_to_continue(const MapFileHeader& header,
                                              const MapOptions& options);

}  // namespace tessera
