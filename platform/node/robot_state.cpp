// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "node/robot_state.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <string_view>
#include <system_error>

#include "base/atomic_file.hpp"
#include "base/input_file.hpp"
#include "base/system_failure.hpp"
#include "tessera/base/internal/crc32.hpp"

namespace tessera {

namespace {

constexpr std::size_t kMostBytes = std::size_t{1} << 15U;
constexpr std::size_t kMostCountBytes = 64;
constexpr std::uint32_t kMost32 = std::numeric_limits<std::uint32_t>::max();

std::string line_of(const char* word, std::uint32_t number) {
  return fmt::format("{} {}\n", word, number);
}

/// Cuts "word number" or "word number number" off the text.
bool take(std::string_view& text, std::string_view word, std::span<std::uint32_t* const> numbers) {
  std::string_view rest = text;
  if (!rest.starts_with(word)) return false;
  rest.remove_prefix(word.size());
  for (std::uint32_t* const number : numbers) {
    if (!rest.starts_with(' ')) return false;
    const char* const end = rest.data() + rest.size();
    const auto [stopped, error] = std::from_chars(rest.data() + 1, end, *number);
    if (error != std::errc{}) return false;
    rest = std::string_view(stopped, end);
  }
  if (!rest.starts_with('\n')) return false;
  text = rest.substr(1);
  return true;
}

bool take(std::string_view& text, std::string_view word, std::uint32_t& number) {
  std::uint32_t* const numbers[] = {&number};
  return take(text, word, numbers);
}

Failure at_end(const std::string& path) {
  return {path + " is at its maximum; give the robot another number", FailureKind::kFailure};
}

bool exists(const std::string& path) {
  std::error_code error;
  return std::filesystem::exists(path, error) || error;
}

}  // namespace

Outcome<FileDescriptor> lock_robot(const std::string& folder, std::uint32_t robot) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    return Failure{"cannot make the folder " + folder + ": " + error.message() +
                   "; name another one"};
  }
  const std::string path = fmt::format("{}/robot_{}.lock", folder, robot);
  constexpr ::mode_t kMode = 0644;
  FileDescriptor file(::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, kMode));
  if (!file.is_open()) return system_failure("open", path, errno, FailureKind::kUsage);
  if (::flock(file.get(), LOCK_EX | LOCK_NB) != 0) {
    if (errno != EWOULDBLOCK) return system_failure("lock", path, errno, FailureKind::kUsage);
    return Failure{
        fmt::format("robot {} is already running, with the state in {}; stop it, or give this one "
                    "another number",
                    robot, folder)};
  }
  return file;
}

std::string RobotState::text_of(const Values& values) const {
  std::string text = "tessera-robot-state 1\n" + line_of("robot", robot_) +
                     line_of("starts", values.starts) + line_of("epoch", values.epoch) +
                     line_of("published", values.published) + line_of("floor", values.floor);
  if (values.map_epoch != 0) text += line_of("map", values.map_epoch);
  for (const RobotFloor& heard : values.floors)
    text += line_of((fmt::format("heard {}", heard.robot)).c_str(), heard.floor);
  char check[16] = {};
  std::snprintf(check, sizeof check, "check %08x\n", crc32c(std::as_bytes(std::span(text))));
  return text + check;
}

Outcome<RobotState::Values> RobotState::parse(const std::string& text) const {
  std::string_view rest = text;
  Values values;
  std::uint32_t version = 0;
  std::uint32_t robot = 0;
  const bool begins = take(rest, "tessera-robot-state", version) && take(rest, "robot", robot) &&
                      take(rest, "starts", values.starts) && take(rest, "epoch", values.epoch) &&
                      take(rest, "published", values.published) &&
                      take(rest, "floor", values.floor);
  if (begins && version == 1 && robot != robot_) {
    return Failure{fmt::format("{} is of robot {}; each robot has its own file, so remove this one",
                               path(), robot)};
  }
  if (begins && rest.starts_with("map ") && !take(rest, "map", values.map_epoch))
    values.map_epoch = 0;
  RobotFloor heard;
  std::uint32_t* const numbers[] = {&heard.robot, &heard.floor};
  while (begins && values.floors.size() < kMostFloors && take(rest, "heard", numbers))
    values.floors.push_back(heard);
  // Equal values have one text, which includes the check.
  if (begins && text == text_of(values)) return values;
  return Failure{path() +
                 " is damaged; restore a copy of it, or remove it and start the robot while robots "
                 "run that have heard it"};
}

/// Reads the file of version 0.1.0: each start was an epoch, and may have published something.
Outcome<RobotState::Values> RobotState::read_count() const {
  const std::string path = stem_ + ".starts";
  if (!exists(path)) return Values{};
  TESSERA_TRY_ASSIGN(const std::string text, read_text_file(path, kMostCountBytes));
  std::uint32_t count = 0;
  std::string_view rest = text;
  const auto [stopped, wrong] = std::from_chars(rest.data(), rest.data() + rest.size(), count);
  rest.remove_prefix(static_cast<std::size_t>(stopped - rest.data()));
  if (wrong != std::errc{} || rest != "\n" || count == 0) {
    return Failure{path +
                   " is not a count of starts; write a number into it that is higher than all "
                   "epochs of this robot that others may have"};
  }
  return Values{.starts = count, .epoch = count, .published = count, .floor = count};
}

Outcome<RobotState> RobotState::open(const std::string& folder, std::uint32_t robot) {
  RobotState state(fmt::format("{}/robot_{}", folder, robot), robot);
  Outcome<Values> values = Values{};
  if (exists(state.path())) {
    TESSERA_TRY_ASSIGN(const std::string text, read_text_file(state.path(), kMostBytes));
    values = state.parse(text);
  } else {
    values = state.read_count();
  }
  if (!values.ok()) return values.failure();
  state.now_ = std::move(*values);
  return state;
}

Outcome<void> RobotState::change(Values next) {
  if (next == now_) return {};
  TESSERA_TRY_ASSIGN(AtomicFile file, AtomicFile::open(path()));
  const std::string text = text_of(next);
  file.write(std::as_bytes(std::span(text)));
  TESSERA_TRY(file.commit());
  now_ = std::move(next);
  return {};
}

/// Never decreases: dropped epochs have lost their places everywhere.
std::uint32_t RobotState::floor_of(const Values& values) const noexcept {
  if (start_ == StartMap::kEmptySubmaps) return std::max(values.floor, values.epoch);
  if (start_ == StartMap::kSubmaps) return std::max(values.floor, values.map_epoch);
  const bool has_earlier = values.published != 0 && values.published < values.epoch;
  const bool keeps = earlier_ == EarlierEpochs::kKeep && has_earlier;
  return std::max(values.floor, keeps ? values.published : values.epoch);
}

Outcome<void> RobotState::begin(EarlierEpochs earlier, StartMap start) {
  if (now_.starts == kMost32 || now_.epoch == kMost32) return at_end(path());
  earlier_ = earlier;
  start_ = start;
  Values next = now_;
  ++next.starts;
  ++next.epoch;
  if (start == StartMap::kEmpty || start == StartMap::kEmptySubmaps) next.map_epoch = next.epoch;
  next.floor = floor_of(next);
  Outcome<void> changed = change(std::move(next));
  // The new file now has all of it.
  if (changed.ok()) ::unlink((stem_ + ".starts").c_str());
  return changed;
}

Outcome<void> RobotState::raise_epoch(std::uint64_t at_least) {
  if (at_least > kMost32) return at_end(path());
  if (at_least <= now_.epoch) return {};
  Values next = now_;
  next.epoch = static_cast<std::uint32_t>(at_least);
  next.published = next.epoch - 1;
  next.floor = floor_of(next);
  return change(std::move(next));
}

Outcome<void> RobotState::raise_starts(std::uint64_t at_least) {
  if (at_least > kMost32) return at_end(path());
  Values next = now_;
  next.starts = std::max(now_.starts, static_cast<std::uint32_t>(at_least));
  return change(std::move(next));
}

Outcome<void> RobotState::note_published(std::uint32_t epoch) {
  Values next = now_;
  next.published = std::max(now_.published, epoch);
  return change(std::move(next));
}

Outcome<void> RobotState::note_floors(std::span<const RobotFloor> heard) {
  Values next = now_;
  std::uint64_t refused = 0;
  for (const RobotFloor& news : heard) {
    if (news.robot == robot_) continue;
    const auto at = std::lower_bound(
        next.floors.begin(), next.floors.end(), news,
        [](const RobotFloor& a, const RobotFloor& b) { return a.robot < b.robot; });
    if (at != next.floors.end() && at->robot == news.robot) {
      at->floor = std::max(at->floor, news.floor);
    } else if (next.floors.size() < kMostFloors) {
      next.floors.insert(at, news);
    } else {
      ++refused;
    }
  }
  Outcome<void> changed = change(std::move(next));
  if (changed.ok()) floors_refused_ += refused;
  return changed;
}

}  // namespace tessera
