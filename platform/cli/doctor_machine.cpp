// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include <fmt/core.h>
#include <sys/resource.h>
#include <sys/timex.h>
#include <time.h>

#include <cstdio>
#include <fstream>
#include <string>

#include "cli/doctor.hpp"
#include "link/key_file.hpp"

namespace tessera {
namespace {

constexpr rlim_t kLockedBytes = rlim_t{1} << 30U;
constexpr unsigned kSysNice = 23;  ///< Bits of /proc/self/status, as capability.h numbers them.
constexpr unsigned kIpcLock = 14;

Check check_monotonic() {
  timespec resolution{};
  const bool known = ::clock_getres(CLOCK_MONOTONIC, &resolution) == 0;
  const std::string found = fmt::format("{} ns", resolution.tv_nsec);
  if (known && resolution.tv_sec == 0 && resolution.tv_nsec <= 1'000'000)
    return {"monotonic clock", CheckState::kGood, found, "1 ms or finer", ""};
  return {"monotonic clock", CheckState::kStops, known ? found : "none", "1 ms or finer",
          "boot a kernel with high-resolution timers"};
}

Check check_wall_clock() {
  timex state{};  // No modes: only reads.
  const int answer = ::adjtimex(&state);
  const bool synchronised = answer >= 0 && answer != TIME_ERROR && (state.status & STA_UNSYNC) == 0;
  // Versions order what robots publish, not times; stamps in logs and status are for people.
  if (synchronised)
    return {"wall clock", CheckState::kGood, "synchronised", "synchronised, for stamps", ""};
  return {"wall clock", CheckState::kAdvice, "not synchronised", "synchronised, for stamps",
          "install chrony or systemd-timesyncd, and wait until it has found its servers"};
}

Check check_key(const std::string& path) {
  const char* const needed = "a fleet key with a mission, readable by its owner only";
  if (path.empty()) {
    return {"key file", CheckState::kAdvice, "none given: anybody can forge datagrams", needed,
            "tessera key new --robots N --dir DIR, then --key DIR/fleet.key"};
  }
  const Outcome<FleetSecret> key = read_fleet_key(path);
  if (!key.ok()) {
    return {"key file", CheckState::kStops, key.failure().text(), needed,
            "do what the message says, or tessera key new --robots N --dir DIR"};
  }
  if (key->mission.empty()) {
    return {"key file", CheckState::kAdvice, path + " names no mission", needed,
            "tessera key mission --new --fleet " + path + ", or [security] mission on every robot"};
  }
  return {"key file", CheckState::kGood, path + ", mission " + key->mission, needed, ""};
}

/// True if this process has that capability, which overrides its limits.
bool has_capability(unsigned bit) {
  std::ifstream status("/proc/self/status");
  std::string line;
  while (std::getline(status, line)) {
    unsigned long long capabilities = 0;
    if (std::sscanf(line.c_str(), "CapEff: %llx", &capabilities) == 1)
      return (capabilities >> bit & 1U) != 0;
  }
  return false;
}

rlim_t limit_of(__rlimit_resource resource) {
  rlimit limit{};
  return ::getrlimit(resource, &limit) == 0 ? limit.rlim_cur : 0;
}

std::string text_of_limit(rlim_t limit) {
  return limit == RLIM_INFINITY ? "no limit" : std::to_string(limit);
}

Check check_priority() {
  const rlim_t limit = limit_of(RLIMIT_RTPRIO);
  if (limit > 0 || has_capability(kSysNice)) {
    const std::string found = limit > 0 ? text_of_limit(limit) : "allowed by CAP_SYS_NICE";
    return {"real-time priority", CheckState::kGood, found, "RLIMIT_RTPRIO 1 or more", ""};
  }
  return {"real-time priority", CheckState::kAdvice, "not allowed", "RLIMIT_RTPRIO 1 or more",
          "LimitRTPRIO=20 in the service, or rtprio 20 in /etc/security/limits.conf"};
}

Check check_locking() {
  const rlim_t limit = limit_of(RLIMIT_MEMLOCK);
  const std::string needed = fmt::format("{} bytes or the map's memory", kLockedBytes);
  if (limit >= kLockedBytes || has_capability(kIpcLock)) {
    const std::string found =
        limit >= kLockedBytes ? text_of_limit(limit) : "allowed by CAP_IPC_LOCK";
    return {"locked memory", CheckState::kGood, found, needed, ""};
  }
  return {"locked memory", CheckState::kAdvice, text_of_limit(limit) + " bytes", needed,
          "LimitMEMLOCK=infinity in the service, or memlock in /etc/security/limits.conf"};
}

}  // namespace

std::vector<Check> check_machine(const DoctorOptions& options) {
  return {check_monotonic(), check_wall_clock(), check_key(options.key), check_priority(),
          check_locking()};
}

}  // namespace tessera
