// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "node/thread_roles.hpp"

#include <dirent.h>
#include <sched.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <memory>

namespace tessera {

namespace {

std::uint64_t mask_of(const std::vector<std::uint32_t>& cpus) {
  std::uint64_t mask = 0;
  for (const std::uint32_t cpu : cpus) mask |= cpu < 64 ? std::uint64_t{1} << cpu : 0;
  return mask;
}

bool runs_only_on(pid_t thread, std::uint64_t cpus) {
  cpu_set_t may{};
  if (::sched_getaffinity(thread, sizeof may, &may) != 0) return true;  // It has ended.
  for (unsigned cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
    const bool wanted = cpu < 64 && (cpus >> cpu & 1U) != 0;
    if (CPU_ISSET(cpu, &may) && !wanted) return false;
  }
  return true;
}

void look_at(pid_t thread, const ThreadRole& role, int mapping_priority, MissingRights& missing) {
  sched_param has{};
  // Threads without a real-time priority have 0 here. One that has ended counts as permitted.
  const bool known = ::sched_getparam(thread, &has) == 0;
  if (known && has.sched_priority != role.priority && role.priority >= mapping_priority)
    missing.priority =
        missing.priority == 0 ? role.priority : std::min(missing.priority, role.priority);
  if (role.cpus != 0 && !runs_only_on(thread, role.cpus)) missing.cpus = true;
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
                    // It works on the global map as long as there is work, and must not take the
                    // processor from others, such as localisation and planning.
                    .sharing = without_priority("tessera-share"),
                    .replay = without_priority("tessera-replay"),
                    .query = without_priority("tessera-query"),
                    .query_link = without_priority("tessera-ask"),
                    .view = without_priority("tessera-view"),
                    .first = without_priority("")};
  roles.mapping.cpus = mask_of(config.mapping_cpus);
  return roles;
}

MissingRights missing_rights(const ThreadRoles& roles) {
  const ThreadRole* const all[] = {&roles.vehicle,    &roles.sensing, &roles.link,   &roles.mapping,
                                   &roles.sending,    &roles.sharing, &roles.replay, &roles.query,
                                   &roles.query_link, &roles.view};
  MissingRights missing;
  const std::string folder = "/proc/self/task/";
  const std::unique_ptr<DIR, int (*)(DIR*)> threads(::opendir(folder.c_str()), ::closedir);
  if (!threads) return missing;
  while (const dirent* const entry = ::readdir(threads.get())) {
    std::string name;
    std::ifstream file(folder + entry->d_name + "/comm");
    if (!std::getline(file, name)) continue;
    const auto thread = static_cast<pid_t>(std::strtol(entry->d_name, nullptr, 10));
    for (const ThreadRole* const role : all) {
      if (role->name == name) look_at(thread, *role, roles.mapping.priority, missing);
    }
  }
  return missing;
}

}  // namespace tessera
