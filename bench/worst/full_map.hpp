// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "meter.hpp"
#include "scenes.hpp"

namespace tessera::bench {

/// Scans 3 and later of a scene, in a map that holds those before.
struct FullMapCase {
  WorstCase worst;
  bool free_space = false;
  bool exactly = false;           ///< Storage is what the scans before take.
  std::size_t storage_bytes = 0;  ///< Else: so much; 0: enough for all.
};

/// Fails with kFailure iff there is no memory for it, or nothing is refused that should be.
/// {storage_bytes, thinned, refused}.
[[nodiscard]] Outcome<Json> measure_full_map(Meter& meter, const Scene& scene,
                                             const FullMapCase& full);

inline constexpr int kSimulatedClasses = 19;
/// What the small scanner of the simulated street sees.
[[nodiscard]] Outcome<Scene> simulated_scene(int scans);

}  // namespace tessera::bench
