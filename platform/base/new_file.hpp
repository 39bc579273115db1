// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A file that must not exist yet: it appears atomically, with its permissions, and never replaces
// another.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "base/outcome.hpp"

namespace tessera {

/// Writes bytes to a new file and makes them durable. mode: permissions, which the process's umask
/// may narrow. Fails with kUsage iff path is empty, something already has that name (even a
/// dangling symbolic link), or its folder is missing or not writable; kFailure iff writing fails.
/// Nothing is left then. Uses the heap.
Outcome<void> write_new_file(const std::string& path, std::span<const std::byte> bytes,
                             unsigned mode);

/// Makes the name of a file itself durable: a new one, or one that was renamed. Best effort: not
/// every file system can sync a folder.
void sync_folder_of(const std::string& path);

}  // namespace tessera
