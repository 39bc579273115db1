// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Houses whose street front has relief: recessed windows and doors, sills, balconies, eaves,
// chimneys.
#pragma once

#include "simulator/assembly.hpp"
#include "simulator/random.hpp"

namespace tessera::street {

struct House {
  double width_m = 10.0;  ///< Along x, centred.
  double depth_m = 8.0;   ///< Along -y; the front is at y = 0 and faces +y.
  int storeys = 2;
  bool balconies = false;
};

void add_house(Assembly& out, Random random, const House& house);

}  // namespace tessera::street
