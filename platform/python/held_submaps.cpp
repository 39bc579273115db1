// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "held_submaps.hpp"

#include <fmt/core.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <system_error>

#include "errors.hpp"

namespace tessera::python {

HeldSubmaps::HeldSubmaps(Mapper& mapper, const MapIdentity& identity, const std::string& folder)
    : mapper_(mapper), identity_(identity) {
  static std::atomic<unsigned> made{0};
  std::string place = folder;
  if (place.empty()) {
    place = own_folder_ = (std::filesystem::temp_directory_path() /
                           fmt::format("tessera-submaps-{}-{}", ::getpid(), made.fetch_add(1)))
                              .string();
  }
  std::error_code error;
  std::filesystem::create_directories(place, error);
  if (error) throw WorkError("cannot make the folder " + place + ": " + error.message());
  memory_ = value_of(ArenaMemory::allocate(SubmapFrames::required_bytes(kMostSubmapsOfRobot)));
  Arena arena(memory_.span());
  frames_ = *SubmapFrames::make(arena, kMostSubmapsOfRobot, mapper.maps().number());
  kept_ =
      value_of(KeptSubmaps::make(fmt::format("{}/robot_{}", place, identity.robot), mapper.map()));
  mapper.maps().require(LocalMaps::User::kKeeping);
}

HeldSubmaps::~HeldSubmaps() {
  kept_->remove();
  std::error_code error;
  if (!own_folder_.empty()) std::filesystem::remove(own_folder_, error);
}

Outcome<void> HeldSubmaps::note(std::int64_t stamp_us, const Matrix34d& T_map_sensor) {
  LocalMaps& maps = mapper_.maps();
  static_cast<void>(frames_.follow(maps, std::nullopt));
  frames_.note(maps.number(), stamp_us, T_map_sensor);
  return kept_->keep_ended(maps, identity_);
}

KeptSubmaps::CurrentSubmap HeldSubmaps::current() const {
  return {mapper_.map(), mapper_.maps().number(), mapper_.submap_note()};
}

Outcome<MapSummary> HeldSubmaps::save(const std::string& path) const {
  return kept_->save_as(path, current(), KeptSubmaps::frames_of(frames_), identity_);
}

std::uint64_t HeldSubmaps::content_digest() const {
  return kept_->digest_with(current(), KeptSubmaps::frames_of(frames_));
}

}  // namespace tessera::python
