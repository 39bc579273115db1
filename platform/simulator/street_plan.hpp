// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Everything in the street that does not move. Each lot of 12 m and each kerb slot of 6 m is drawn
// from its own number, so a longer street has the same middle.
#pragma once

#include <cstdint>
#include <vector>

#include "simulator/ground.hpp"
#include "simulator/primitive.hpp"

namespace tessera::street {

std::vector<Primitive> lay_out_street(std::uint64_t seed, const Ground& ground,
                                      double half_length_m);

}  // namespace tessera::street
