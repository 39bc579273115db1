// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Datagrams of those who have the key and mean harm, or who have none.
#pragma once

#include <vector>

#include "fuzz/fuzz.hpp"
#include "tessera/exchange/exchange.hpp"

namespace tessera::fuzz {

using Datagram = std::vector<std::byte>;

/// The tag of one who has the key, in place of the last bytes. Nothing if there is no room for one.
void seal(Datagram& datagram);
/// Whether the tag is right.
bool is_sealed(Bytes datagram);

/// A datagram with its tag. configuration: of the fleet.
Datagram forged(DatagramHeader header, Bytes body);

/// A body that is well formed, of few contributions, versions and blocks, so that what is said of
/// them contradicts what is said elsewhere.
Datagram drawn_body(Input& input, DatagramKind kind);

/// Of all that can become of a datagram but being heard.
std::uint64_t refusals(const ExchangeReport& report);

}  // namespace tessera::fuzz
