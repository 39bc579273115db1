// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Ctrl+C and SIGTERM as a flag that long work checks, so that it can write what it has.
#pragma once

#include <atomic>

namespace tessera {

/// From now on the first SIGINT or SIGTERM of the process sets stop, which must outlive the
/// process's work; the second ends the process at once, as without this call. For programs, not for
/// libraries: it replaces the process's handlers of these signals.
void stop_by_signals(std::atomic<bool>& stop);

}  // namespace tessera
