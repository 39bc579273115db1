// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Names under which a node keeps maps that would be lost: of an earlier epoch, or from before the
// map was cleared. Files with these names are never overwritten or deleted.
#pragma once

#include <cstdint>
#include <string>

#include "base/outcome.hpp"

namespace tessera {

/// For "local.tsm" and epoch 3 "local.epoch-3.tsm"; if a file has that name "local.epoch-3.2.tsm",
/// and so on. Fails with kFailure iff 10,000 of them exist.
Outcome<std::string> free_epoch_name(const std::string& path, std::uint32_t epoch);

/// Gives the file at path a second name, with the epoch of its header, so that writing to path
/// loses nothing; renames it if the file system has no links. "local.earlier.tsm" if it is not a
/// readable map. Returns the name, or empty iff there is no file or it already has such a name, as
/// after a crash. Fails with kUsage iff the system refuses, and as free_epoch_name.
Outcome<std::string> keep_earlier_map(const std::string& path);

/// Gives an archive another name, "blocks.earlier.tsa" and so on. Returns it, or empty iff there is
/// no file. Fails with kUsage iff another process uses the file or the system refuses, and as
/// free_epoch_name.
Outcome<std::string> keep_earlier_archive(const std::string& path);

}  // namespace tessera
