// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Signatures of an attacker who has every robot's key, so that what is behind their check is
// reached. Toy signatures: network/toy_signatures.hpp.
#pragma once

#include "fuzz/forged_datagram.hpp"

namespace tessera::fuzz {

/// Signs a datagram of a fleet that signs: writes the right signature at each place where its kind
/// has one, as the robot that is named there. Returns how many were right before. Leaves the tag as
/// it is.
int sign(Datagram& datagram);

}  // namespace tessera::fuzz
