// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How a soak goes on after it was stopped: a folder with what it knows and a copy of the robots'
// files at the end of a minute. What a process had in memory is not kept: all robots are started
// again then, as after a power cut.
#include <fmt/core.h>

#include <filesystem>
#include <fstream>

#include "base/atomic_file.hpp"
#include "base/input_file.hpp"
#include "soak/soak.hpp"

namespace tessera::soak {

namespace {

namespace fs = std::filesystem;

Failure failed(const std::string& what, const std::error_code& error) {
  return Failure{what + ": " + error.message(), FailureKind::kFailure};
}

Outcome<void> copy_folder(const std::string& from, const std::string& to) {
  std::error_code error;
  fs::remove_all(to, error);
  fs::create_directories(to, error);
  fs::copy(from, to, fs::copy_options::recursive, error);
  if (error) return failed("cannot copy " + from + " to " + to, error);
  return {};
}

Outcome<Json> read_json(const std::string& path) {
  std::ifstream file(path);
  Json json = Json::parse(file, nullptr, false);
  if (json.is_discarded()) return Failure{path + " is missing or no JSON"};
  return json;
}

/// Lines of minutes that come after the checkpoint are left out.
Outcome<void> cut_lines(const std::string& path, int minutes) {
  std::ifstream file(path);
  std::string kept;
  std::string line;
  for (int i = 0; i < minutes && std::getline(file, line); ++i) kept += line + "\n";
  file.close();
  std::ofstream(path, std::ios::trunc) << kept;
  return {};
}

}  // namespace

Json SoakOptions::fixed() const {
  return {{"seed", seed},         {"robots", robots},           {"resolution_m", resolution_m},
          {"submap_m", submap_m}, {"map_submaps", map_submaps}, {"kills", kills}};
}

/// Calls visit(name, member) for each.
template <class Sums, class Visit>
void for_each_total(Sums& totals, Visit&& visit) {
  visit("kills", totals.kills);
  visit("team_kills", totals.team_kills);
  visit("restarts", totals.restarts);
  visit("maps", totals.maps);
  visit("corrections", totals.corrections);
  visit("partitions", totals.partitions);
  visit("violations", totals.violations);
  visit("late", totals.late);
  visit("worst_settle_s", totals.worst_settle_s);
  visit("worst_false", totals.worst_false);
  visit("worst_ratio", totals.worst_ratio);
  visit("recounted", totals.recounted);
  visit("worst_miscounted", totals.worst_miscounted);
  visit("wall_s", totals.wall_s);
  visit("processor_s", totals.processor_s);
  visit("allocations", totals.allocations);
}

Json Totals::state() const {
  Json state;
  for_each_total(*this, [&](const char* name, const auto& value) { state[name] = value; });
  return state;
}

void Totals::restore(const Json& state) {
  for_each_total(*this, [&](const char* name, auto& value) { state.at(name).get_to(value); });
}

std::string Soak::path(const char* name) const { return options_.folder + "/" + name; }

Json Soak::state() const {
  Json robots = Json::array();
  for (const auto& robot : robots_)
    robots.push_back({{"drive", robot->drive.state()},
                      {"member", robot->member.state()},
                      {"scans", robot->scans}});
  return {{"options", options_.fixed()},
          {"minute", minute_},
          {"now_us", now_us_},
          {"groups", links_.groups()},
          {"partition_end_us", partition_end_us_},
          {"totals", totals_.state()},
          {"robots", std::move(robots)},
          {"logbook", logbook_.state()}};
}

void Soak::restore(const Json& state) {
  minute_ = state.at("minute");
  now_us_ = state.at("now_us");
  links_.partition(state.at("groups").get<std::vector<int>>());
  partition_end_us_ = state.at("partition_end_us");
  totals_.restore(state.at("totals"));
  for (std::size_t i = 0; i < robots_.size(); ++i) {
    const Json& from = state.at("robots").at(i);
    robots_[i]->drive.restore(from.at("drive"));
    robots_[i]->member.restore(from.at("member"));
    robots_[i]->scans = from.at("scans");
  }
  logbook_.restore(state.at("logbook"));
}

/// A new folder is complete before the file that names it says so.
Outcome<void> Soak::save_checkpoint() {
  const std::string name = fmt::format("checkpoint-{}", minute_);
  const std::string folder = path(name.c_str());
  TESSERA_TRY(copy_folder(path("state"), folder + "/state"));
  TESSERA_TRY(write_report(state(), folder + "/soak.json"));
  TESSERA_TRY(write_report({{"checkpoint", name}}, path("checkpoint.json")));
  std::error_code error;
  std::vector<fs::path> old;
  for (const fs::directory_entry& entry : fs::directory_iterator(options_.folder, error)) {
    const std::string file = entry.path().filename().string();
    if (file.starts_with("checkpoint-") && file != name) old.push_back(entry.path());
  }
  for (const fs::path& one : old) fs::remove_all(one, error);
  return {};
}

Outcome<void> Soak::load_checkpoint() {
  TESSERA_TRY_ASSIGN(const Json latest, read_json(path("checkpoint.json")));
  const std::string folder = path(latest.at("checkpoint").get<std::string>().c_str());
  TESSERA_TRY_ASSIGN(const Json saved, read_json(folder + "/soak.json"));
  if (saved.at("options") != options_.fixed())
    return Failure{"the soak in " + options_.folder + " has the options " +
                   saved.at("options").dump() + "; give the same"};
  TESSERA_TRY(copy_folder(folder + "/state", path("state")));
  restore(saved);
  TESSERA_TRY(cut_lines(path("minutes.jsonl"), minute_));
  for (const auto& robot : robots_) {
    TESSERA_TRY(robot->member.start(true));
    ++totals_.restarts;
  }
  return {};
}

}  // namespace tessera::soak
