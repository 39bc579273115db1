// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What is looked at after each minute, and what is said of it.
#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <set>

#include "soak/soak.hpp"

namespace tessera::soak {

namespace {

constexpr double kMiB = 1024.0 * 1024.0;

/// Of this process.
double resident_mib() {
  std::ifstream file("/proc/self/statm");
  std::uint64_t all = 0;
  std::uint64_t resident = 0;
  file >> all >> resident;
  return static_cast<double>(resident) * static_cast<double>(::sysconf(_SC_PAGESIZE)) / kMiB;
}

}  // namespace

void Soak::report_fault(const std::string& fault) {
  ++totals_.violations;
  std::printf("minute %d: VIOLATION: %s\n", minute_, fault.c_str());
  std::fflush(stdout);
}

/// One robot speaks for all that agree with it.
Json Soak::check(double settle_s) {
  const bool agrees = agree();
  if (!agrees) report_fault(fmt::format("digests differ after {:.0f} s", settle_s));
  totals_.late += settle_s > 0.0 ? 1U : 0U;
  totals_.worst_settle_s = std::max(totals_.worst_settle_s, settle_s);
  std::vector<std::string> faults;
  MemoryUse memory;
  Truth all;
  std::uint64_t files = 0;
  std::uint64_t allocations = 0;
  std::set<int> seen;
  for (const auto& robot : robots_) {
    if (!robot->member.is_running()) continue;
    const tessera::Robot& one = robot->member.robot();
    const MemoryUse use = check_memory(one, faults);
    memory.given_bytes += use.given_bytes;
    memory.used_bytes += use.used_bytes;
    files += robot->member.file_bytes();
    allocations += robot->member.allocations().value_or(0);
    const int group = links_.groups()[robot->member.number()];
    if (!seen.insert(group).second && agrees) continue;
    const Truth truth = check_truth(one, logbook_, grid_, faults);
    all.take(truth);
  }
  for (const auto& robot : robots_) {
    for (std::string& note : robot->member.take_notes()) faults.push_back(std::move(note));
  }
  if (allocations + totals_.allocations != 0) {
    faults.push_back(
        fmt::format("robots have allocated {} times", allocations + totals_.allocations));
    totals_.allocations = 0;
  }
  for (const std::string& fault : faults) report_fault(fault);
  totals_.worst_false = std::max(totals_.worst_false, all.worst_false);
  totals_.worst_ratio = std::max(totals_.worst_ratio, all.most_ratio);
  totals_.recounted += all.recounted;
  totals_.worst_miscounted = std::max(totals_.worst_miscounted, all.most_miscounted);
  return {{"minute", minute_},
          {"virtual_s", 1e-6 * static_cast<double>(now_us_)},
          {"km", way_km()},
          {"kills", totals_.kills},
          {"restarts", totals_.restarts},
          {"maps", totals_.maps},
          {"corrections", totals_.corrections},
          {"partitioned", partition_end_us_ != 0},
          {"settle_s", settle_s},
          {"agrees", agrees},
          {"contributions", all.contributions},
          {"misplaced", all.misplaced},
          {"worst_off_m", all.worst_m},
          {"occupied", all.occupied},
          {"far", all.far},
          {"false", all.false_voxels},
          {"evidence", all.evidence},
          {"mapped", all.mapped},
          {"most_ratio", all.most_ratio},
          {"recounted", all.recounted},
          {"most_miscounted", all.most_miscounted},
          {"given_mib", static_cast<double>(memory.given_bytes) / kMiB},
          {"used_mib", static_cast<double>(memory.used_bytes) / kMiB},
          {"resident_mib", resident_mib()},
          {"file_mib", static_cast<double>(files) / kMiB},
          {"violations", totals_.violations}};
}

void Soak::say_minute(const Json& row) const {
  std::ofstream(path("minutes.jsonl"), std::ios::app) << row.dump() << "\n";
  std::printf(
      "minute %d of %d: %.1f s (%.1f s of processor), %.2f km, %llu kills, %llu maps, %llu "
      "corrections; %s after %.0f "
      "s%s; "
      "%u contributions, off by %.2f m at most; %llu occupied, %llu far, %llu false; evidence "
      "%.2f; "
      "%.0f of %.0f MiB\n",
      minute_, options_.minutes, row["wall_s"].get<double>(), row["processor_s"].get<double>(),
      row["km"].get<double>(), static_cast<unsigned long long>(totals_.kills),
      static_cast<unsigned long long>(totals_.maps),
      static_cast<unsigned long long>(totals_.corrections),
      row["agrees"].get<bool>() ? "equal" : "NOT EQUAL", row["settle_s"].get<double>(),
      row["partitioned"].get<bool>() ? ", cut off" : "", row["contributions"].get<unsigned>(),
      row["worst_off_m"].get<double>(), row["occupied"].get<unsigned long long>(),
      row["far"].get<unsigned long long>(), row["false"].get<unsigned long long>(),
      row["evidence"].get<double>() / std::max(1.0, row["mapped"].get<double>()),
      row["used_mib"].get<double>(), row["given_mib"].get<double>());
  std::fflush(stdout);
}

void Soak::say_totals() const {
  Counts limits;
  Counts events;
  for (const auto& robot : robots_) {
    add(limits, robot->member.limits());
    add(events, robot->member.events());
  }
  const auto line = [](const std::string& name, double value, const char* unit, int digits = 0) {
    std::printf("  %-44s %14.*f %s\n", name.c_str(), digits, value, unit);
  };
  std::printf("\n%d robots, streets of %.1f km, voxels of %.2f m, submaps of %.0f m\n",
              options_.robots, 1e-3 * grid_.length_m(), options_.resolution_m, options_.submap_m);
  line("virtual time", 1e-6 * static_cast<double>(now_us_) / 3600.0, "h", 2);
  line("minutes", minute_, "");
  line("wall time", totals_.wall_s / 60.0, "min", 1);
  line("processor time", totals_.processor_s / 60.0, "min", 1);
  line("driven by all", way_km(), "km", 2);
  line("kills", static_cast<double>(totals_.kills), "");
  line("of these, all at once", static_cast<double>(totals_.team_kills), "times");
  line("restarts with the map of before", static_cast<double>(totals_.restarts), "");
  line("maps begun empty", static_cast<double>(totals_.maps), "");
  line("corrections", static_cast<double>(totals_.corrections), "");
  line("partitions", static_cast<double>(totals_.partitions), "");
  const auto tried = static_cast<double>(std::max<std::uint64_t>(1, links_.tried()));
  line("datagrams lost since the last start", 100.0 * static_cast<double>(links_.lost()) / tried,
       "%", 1);
  line("datagrams sent since the last start", static_cast<double>(links_.sent()), "");
  for (const auto& [name, count] : events) line(name, static_cast<double>(count), "");
  std::printf("invariants\n");
  line("violations", static_cast<double>(totals_.violations), "");
  line("minutes that took longer to be equal", static_cast<double>(totals_.late), "");
  line("longest after the minute's end", totals_.worst_settle_s, "s", 1);
  line("most false occupied voxels", 100.0 * totals_.worst_false, "%", 3);
  line("most evidence of a submap over its points", totals_.worst_ratio, "", 3);
  line("voxels counted again from the replicas", static_cast<double>(totals_.recounted), "");
  line("most by which one differed", 100.0 * totals_.worst_miscounted, "%", 2);
  std::printf("known limits: measured, not asserted\n");
  for (const auto& [name, count] : limits) line(name, static_cast<double>(count), "");
}

}  // namespace tessera::soak
