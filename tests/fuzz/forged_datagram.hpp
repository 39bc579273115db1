// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Datagrams of those who have the key and mean harm, or who have none.
#pragma once

#include <vector>

#include "fuzz/fuzz.hpp"
#include "tessera/exchange/exchange.hpp"

namespace tessera::fuzz {

using Datagram = std::vector<std::byte>;

/// Numbers of kinds are 1 to this, some of them perhaps of none.
inline constexpr unsigned kMostKind = 9;

/// The tag of one who has the key, in place of the last bytes. Nothing if there is no room for one.
void seal(Datagram& datagram);
/// Whether the tag is right.
bool is_sealed(Bytes datagram);

/// A datagram with its tag, and, if its header says so, with signatures that are right where the
/// body has room for them (forged_signature.hpp). header.configuration: of the fleet.
Datagram forged(const DatagramHeader& header, Bytes body);

/// A body that is well formed, of few contributions, versions and blocks, so that what is said of
/// them contradicts what is said elsewhere. is_signed: it has room for the signatures of its kind.
/// Of a kind that is not known here: any bytes.
Datagram drawn_body(Input& input, DatagramKind kind, bool is_signed);
/// A body with the first frame of the contribution that a body begins with, relayed.
Datagram relayed_frame(Bytes body, bool is_signed);

/// Of all that can become of a datagram but being heard.
std::uint64_t refusals(const ExchangeReport& report);

}  // namespace tessera::fuzz
