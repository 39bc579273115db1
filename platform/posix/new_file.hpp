// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A file that must not be there yet: it appears whole, with its permissions, or not at all, and
// nothing is ever replaced.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "posix/outcome.hpp"

namespace tessera {

/// Writes bytes to a new file and makes them durable. mode: permissions, which the process's umask
/// may narrow. Fails with kUsage iff path is empty, something has that name already (a dangling
/// symbolic link too), or its folder is missing or not writable; kFailure iff writing fails.
/// Nothing is left behind then. Uses the heap.
Outcome<void> write_new_file(const std::string& path, std::span<const std::byte> bytes,
                             unsigned mode);

}  // namespace tessera
