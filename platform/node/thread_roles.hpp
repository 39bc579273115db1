// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Priorities of the threads of a node. Threads that only pass data on are above the mapping thread,
// as they need little time and their data must not be lost; the sharing thread is below it.
#pragma once

#include "base/thread.hpp"
#include "node/node_config.hpp"

namespace tessera {

struct ThreadRoles {
  ThreadRole vehicle;  ///< The CAN bus.
  ThreadRole sensing;  ///< Receives sensor data.
  ThreadRole link;     ///< Receives datagrams of other robots.
  ThreadRole mapping;
  ThreadRole sending;
  ThreadRole sharing;
  ThreadRole replay;
  ThreadRole query;       ///< Answers planners in spare time.
  ThreadRole query_link;  ///< Receives their queries.
  ThreadRole view;        ///< Shows maps in browsers; after all others.
  ThreadRole first;       ///< The first thread of the program: saves maps and writes the log.
};

/// What was requested and the system did not permit.
struct MissingRights {
  /// The lowest refused priority, from that of the mapping thread up; 0: none.
  int priority = 0;
  bool cpus = false;  ///< Of any thread.
};

/// With [realtime] priority P: the vehicle P + 3, sensing P + 2, link P + 1, mapping P, sending P -
/// 1 but at least 1; the others none.
[[nodiscard]] ThreadRoles thread_roles(const NodeConfig& config);

/// Checks what the threads of this process, found by their names, really have. Uses the heap.
[[nodiscard]] MissingRights missing_rights(const ThreadRoles& roles);

}  // namespace tessera
