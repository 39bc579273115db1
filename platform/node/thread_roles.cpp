// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "node/thread_roles.hpp"

#include <algorithm>

namespace tessera {

namespace {

std::uint64_t mask_of(const std::vector<std::uint32_t>& cpus) {
  std::uint64_t mask = 0;
  for (const std::uint32_t cpu : cpus) mask |= cpu < 64 ? std::uint64_t{1} << cpu : 0;
  return mask;
}

}  // namespace

ThreadRoles thread_roles(const NodeConfig& config) {
  const std::uint64_t others = mask_of(config.other_cpus);
  const auto role = [&](const char* name, int above) {
    const int priority = static_cast<int>(config.priority) + above;
    return ThreadRole{name, config.priority == 0 ? 0 : std::max(priority, 1), others};
  };
  const auto without_priority = [&](const char* name) { return ThreadRole{name, 0, others}; };
  ThreadRoles roles{.vehicle = role("tessera-can", 3),
                    .sensing = role("tessera-sense", 2),
                    .link = role("tessera-link", 1),
                    .mapping = role("tessera-map", 0),
                    .sending = role("tessera-send", -1),
                    // It works on the global map for as long as there is something to do, and must
                    // not keep others from the processor: who localises, who plans.
                    .sharing = without_priority("tessera-share"),
                    .replay = without_priority("tessera-replay"),
                    .query = without_priority("tessera-query")};
  roles.mapping.cpus = mask_of(config.mapping_cpus);
  return roles;
}

}  // namespace tessera
