// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Names under which maps stay that a node would lose: of an earlier epoch, or from before the map
// was cleared. Nothing is ever overwritten or deleted under these names.
#pragma once

#include <cstdint>
#include <string>

#include "posix/outcome.hpp"

namespace tessera {

/// Of "local.tsm" and epoch 3 "local.epoch-3.tsm"; if a file has that name "local.epoch-3.2.tsm",
/// and so on. Fails with kFailure iff 10,000 of them are there.
Outcome<std::string> free_epoch_name(const std::string& path, std::uint32_t epoch);

/// Gives the file at path a second name, that of the epoch in its header, so that writing to path
/// loses nothing; where the file system has no links it is renamed. "local.earlier.tsm" if it is no
/// map that can be read. The value is the name, or empty iff there is no file or it has such a name
/// already, as after a crash. Fails with kUsage iff the system refuses, and as free_epoch_name.
Outcome<std::string> keep_earlier_map(const std::string& path);

}  // namespace tessera
