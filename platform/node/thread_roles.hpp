// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Which thread of a node goes before which. Those that only hand over come before the one that
// maps, as they take little and what they bring must not be lost; what shares comes after it.
#pragma once

#include "node/node_config.hpp"
#include "posix/thread.hpp"

namespace tessera {

struct ThreadRoles {
  ThreadRole vehicle;  ///< The CAN bus.
  ThreadRole sensing;  ///< Receives what sensors send.
  ThreadRole link;     ///< Receives what other robots send.
  ThreadRole mapping;
  ThreadRole sending;
  ThreadRole sharing;
  ThreadRole replay;
  ThreadRole query;       ///< Answers planners; takes what is left.
  ThreadRole query_link;  ///< Receives what they ask.
  ThreadRole view;        ///< Shows maps in browsers; behind all others.
  ThreadRole first;       ///< That of the program: it saves and writes the log.
};

/// What was asked for and the system did not permit.
struct MissingRights {
  /// The lowest that a thread was refused, from the mapping thread's up; 0: none.
  int priority = 0;
  bool cpus = false;  ///< Of any thread.
};

/// With [realtime] priority P: the vehicle P + 3, sensing P + 2, link P + 1, mapping P, sending P -
/// 1 but at least 1; the others none.
[[nodiscard]] ThreadRoles thread_roles(const NodeConfig& config);

/// By what the threads of this process, known by their names, really have. Uses the heap.
[[nodiscard]] MissingRights missing_rights(const ThreadRoles& roles);

}  // namespace tessera
