// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A clock that tests set.
#pragma once

#include "tessera/inference/deadline.hpp"

namespace tessera {

/// Shows what it is set to; each reading adds step_us.
struct HandClock {
  std::int64_t time_us = 0;
  std::int64_t step_us = 0;
  [[nodiscard]] Clock clock() {
    return {this, [](void* self) {
              auto* const hand = static_cast<HandClock*>(self);
              return hand->time_us += hand->step_us;
            }};
  }
};

}  // namespace tessera
