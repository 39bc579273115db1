// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A network that the test has to itself: a namespace with a loopback interface and nothing else, so
// that no packet reaches the machine's networks and none from there disturbs.
#pragma once

#include <string>

#include "link/datagram_link.hpp"

namespace tessera {

/// Moves the whole process there for good, at the first call; with multicast and a route for it on
/// the loopback interface. False, with a word for ctest to skip by, iff the system does not permit
/// it. The process must have one thread only.
bool enter_own_network();

/// Of a test: a URL of its own for liblcm as well, the loopback interface named.
LinkConfig loopback_config();

/// Asks until condition is true, for two seconds at most; whether it became so.
template <class Condition>
bool eventually(Condition condition);

/// One millisecond.
void wait_a_little();

template <class Condition>
bool eventually(Condition condition) {
  for (int i = 0; i < 2000; ++i) {
    if (condition()) return true;
    wait_a_little();
  }
  return condition();
}

}  // namespace tessera
