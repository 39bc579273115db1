// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "base/outcome.hpp"

namespace tessera {

/// The number of one run of a robot: starts in the upper 32 bits, random bits below. Later starts
/// have higher numbers, and two processes with the same count of starts have different ones. Fails
/// with kFailure iff the system gives no random numbers.
Outcome<std::uint64_t> make_session(std::uint32_t starts);

/// A secret seed for indices of data that other robots send (MapConfig::hash_seed).
/// Fails as make_session.
Outcome<std::uint64_t> make_hash_seed();

}  // namespace tessera
