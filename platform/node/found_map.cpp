// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "node/found_map.hpp"

#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <string_view>
#include <system_error>

#include "maps/kept_submaps.hpp"

namespace tessera {

namespace {

namespace fs = std::filesystem;

constexpr std::string_view kJournalEnd = ".tsj";
constexpr std::string_view kFileEnd = ".tsm";
constexpr std::string_view kNewEnd = ".tsj.new";
constexpr int kMostNames = 10'000;

/// Of a file "NAME.submap-NUMBER" with this end.
std::optional<std::uint32_t> number_in(std::string_view file, std::string_view name,
                                       std::string_view end) {
  const std::string begin = std::string(name) + ".submap-";
  if (file.size() <= begin.size() + end.size() || !file.starts_with(begin) || !file.ends_with(end))
    return std::nullopt;
  const std::string_view digits =
      file.substr(begin.size(), file.size() - begin.size() - end.size());
  std::uint32_t number = 0;
  const auto [stopped, error] =
      std::from_chars(digits.data(), digits.data() + digits.size(), number);
  if (error != std::errc{} || stopped != digits.data() + digits.size()) return std::nullopt;
  return number;
}

/// Names of all files of a map, in order.
Outcome<std::vector<std::string>> files_of(const MapName& name) {
  const std::string begin = fs::path(name.stem()).filename().string() + ".";
  std::vector<std::string> files;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(name.folder, error)) {
    std::string file = entry.path().filename().string();
    if (file.starts_with(begin)) files.push_back(std::move(file));
  }
  if (error)
    return Failure{"cannot read the folder " + name.folder + ": " + error.message(),
                   FailureKind::kFailure};
  std::sort(files.begin(), files.end());
  return files;
}

/// Another name, which no file has. Returns a line about it.
std::string renamed(const std::string& path, const std::string& end, const std::string& why) {
  std::string to = path + end;
  std::error_code error;
  for (int i = 2; fs::exists(fs::symlink_status(to, error)) && i <= kMostNames; ++i)
    to = fmt::format("{}{}.{}", path, end, i);
  const bool moved = ::rename(path.c_str(), to.c_str()) == 0;
  return path + (moved ? " is now " + to : " cannot be renamed and is left out") + ": " + why;
}

struct Numbers {
  std::vector<std::uint32_t> journals;
  std::vector<std::uint32_t> files;
};

/// Which submaps there are; of files that were not written whole nothing stays.
Numbers numbers_in(const std::vector<std::string>& files, const MapName& name) {
  const std::string begin = fs::path(name.stem()).filename().string();
  Numbers found;
  for (const std::string& file : files) {
    if (number_in(file, begin, kNewEnd)) ::unlink((name.folder + "/" + file).c_str());
    if (const auto number = number_in(file, begin, kJournalEnd)) found.journals.push_back(*number);
    if (const auto number = number_in(file, begin, kFileEnd)) found.files.push_back(*number);
  }
  std::sort(found.journals.begin(), found.journals.end());
  std::sort(found.files.begin(), found.files.end());
  return found;
}

bool is_of(const MapName& name, const MapFileHeader& header) {
  return header.identity.robot == name.robot && header.identity.epoch == name.epoch;
}

void read_frames(FoundMap& found) {
  const std::string path = found.name.frames();
  std::error_code error;
  if (!fs::exists(path, error)) return;
  Outcome<SubmapState> state = read_submap_state(path);
  if (!state.ok()) {
    if (state.failure().kind == FailureKind::kUsage)
      found.notes.push_back(renamed(path, ".damaged", state.failure().text(Speaker::kFile)));
    return;
  }
  if (state->robot != found.name.robot || state->epoch != found.name.epoch) {
    found.notes.push_back(renamed(path, ".other", "it is of another map"));
    return;
  }
  found.state = std::move(*state);
  found.has_frames = true;
}

/// Rows of the files that are there: by what was noted of them, or by themselves.
void find_kept(const std::vector<std::uint32_t>& files, FoundMap& found) {
  const std::vector<SubmapRow> noted = std::move(found.state.kept);
  found.state.kept.clear();
  for (const std::uint32_t number : files) {
    const std::string path = KeptSubmaps::path_of(found.name.stem(), number);
    const std::optional<KeptSubmaps::Found> one = KeptSubmaps::find(path, number);
    if (!one) {
      found.notes.push_back(renamed(path, ".damaged", "it cannot be read"));
      continue;
    }
    if (!is_of(found.name, one->header)) {
      found.notes.push_back(renamed(path, ".other", "it is of another map"));
      continue;
    }
    const auto row = std::find_if(noted.begin(), noted.end(), [&](const SubmapRow& known) {
      return known.number == number && known.bytes == one->row.bytes &&
             known.digest == one->row.digest;
    });
    found.state.kept.push_back(row != noted.end() ? *row : one->row);
    found.kept_headers.push_back(one->header);
  }
  for (const SubmapRow& row : noted) {
    if (!std::binary_search(files.begin(), files.end(), row.number))
      found.notes.push_back(KeptSubmaps::path_of(found.name.stem(), row.number) + " is missing");
  }
}

/// False: it is not to be read.
bool check_journal(std::uint32_t number, FoundMap& found) {
  const std::string path = found.name.journal(number);
  const Outcome<RecordHeader> header = inspect_journal(path);
  if (!header.ok()) {
    found.notes.push_back(header.failure().text(Speaker::kFile) + "; it is left out");
    return false;
  }
  switch (header->state) {
    case RecordHeader::State::kOtherVersion:
      found.notes.push_back(renamed(path, ".other", header->what));
      return false;
    case RecordHeader::State::kForeign:
    case RecordHeader::State::kDamaged:
      // Its name says what it is, and its records have checksums.
      found.notes.push_back(path +
                            ": its begin is damaged, and is taken to be as the settings say");
      found.journals.push_back({number, std::nullopt});
      return true;
    case RecordHeader::State::kWhole:
      break;
  }
  if (!is_of(found.name, header->map)) {
    found.notes.push_back(renamed(path, ".other", "it is of another map"));
    return false;
  }
  found.journals.push_back({number, header->map});
  return true;
}

void find_journals(const std::vector<std::uint32_t>& journals, FoundMap& found) {
  for (const std::uint32_t number : journals) {
    const bool is_kept = std::any_of(found.state.kept.begin(), found.state.kept.end(),
                                     [&](const SubmapRow& row) { return row.number == number; });
    if (is_kept) {
      ::unlink(found.name.journal(number).c_str());
    } else {
      check_journal(number, found);
    }
  }
  // Two at most can be in memory, and they follow each other.
  const auto is_too_early = [&] {
    return found.journals.size() > 2 ||
           (found.journals.size() == 2 && found.journals[0].submap + 1 != found.journals[1].submap);
  };
  while (is_too_early()) {
    found.notes.push_back(renamed(found.name.journal(found.journals.front().submap), ".other",
                                  "it is not of the last submaps"));
    found.journals.erase(found.journals.begin());
  }
}

}  // namespace

std::string MapName::stem() const {
  return fmt::format("{}/robot_{}.epoch-{}", folder, robot, epoch);
}

std::string MapName::journal(std::uint32_t submap) const {
  return fmt::format("{}.submap-{}{}", stem(), submap, kJournalEnd);
}

Outcome<std::optional<FoundMap>> find_map(const MapName& name) {
  TESSERA_TRY_ASSIGN(const std::vector<std::string> files, files_of(name));
  const Numbers numbers = numbers_in(files, name);
  FoundMap found;
  found.name = name;
  for (const auto* const all : {&numbers.journals, &numbers.files}) {
    if (!all->empty()) found.next = std::max(found.next, all->back() + 1);
  }
  read_frames(found);
  find_kept(numbers.files, found);
  find_journals(numbers.journals, found);
  if (found.journals.empty() && found.state.kept.empty()) return std::optional<FoundMap>();
  // Frames are from the first submap that there ever was, without a gap.
  const bool follow = !found.state.frames.empty() && found.state.first <= found.first();
  if (!follow) {
    if (found.has_frames && !found.state.frames.empty())
      found.notes.push_back(renamed(name.frames(), ".other", "it is not of these submaps"));
    found.has_frames = false;
    found.state.frames.clear();
    found.state.revision = 0;
    found.state.first = found.state.kept.empty()
                            ? found.first()
                            : std::min(found.first(), found.state.kept[0].number);
  }
  return std::optional(std::move(found));
}

bool can_continue(const FoundMap& found, const MapConfig& config, const ClassTable& classes,
                  bool in_submaps) {
  // One map has the memory of two submaps, and would lose what has no room in one.
  if (found.has_frames && found.state.in_submaps != in_submaps) return false;
  if (!in_submaps && (!found.state.kept.empty() || found.journals.size() != 1 ||
                      found.state.first != found.first()))
    return false;
  const auto fits = [&](const MapFileHeader& header) {
    return has_settings(header, config, classes);
  };
  return std::all_of(found.kept_headers.begin(), found.kept_headers.end(), fits) &&
         std::all_of(found.journals.begin(), found.journals.end(),
                     [&](const FoundMap::Journal& journal) {
                       return !journal.header || fits(*journal.header);
                     });
}

std::vector<std::string> set_aside(const MapName& name) {
  std::vector<std::string> lines;
  const Outcome<std::vector<std::string>> files = files_of(name);
  if (!files.ok()) return lines;
  for (const std::string& file : *files) {
    const bool is_of_map =
        file.ends_with(kFileEnd) || file.ends_with(kJournalEnd) || file.ends_with(".frames");
    if (is_of_map)
      lines.push_back(renamed(name.folder + "/" + file, ".earlier",
                              "it is of an earlier map, which the robot's state does not know of"));
  }
  return lines;
}

}  // namespace tessera
