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
  ThreadRole query;  ///< Answers planners; takes what is left.
};

/// With [realtime] priority P: the vehicle P + 3, sensing P + 2, link P + 1, mapping P, sending P -
/// 1 but at least 1; the others none.
[[nodiscard]] ThreadRoles thread_roles(const NodeConfig& config);

}  // namespace tessera
