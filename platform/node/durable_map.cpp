// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "node/durable_map.hpp"

#include <algorithm>

#include "base/boot_id.hpp"
#include "settings/map_options.hpp"
#include "tessera/registration/scan.hpp"

namespace tessera {

namespace {

bool is_kept(const KeptSubmaps* kept, std::uint32_t number) {
  return kept != nullptr && std::any_of(kept->rows().begin(), kept->rows().end(),
                                        [&](const SubmapRow& row) { return row.number == number; });
}

bool has_pose(const JournalNote& note) {
  Matrix34d T_map_body;
  std::copy(note.T_map_body.begin(), note.T_map_body.end(), T_map_body.data());
  return note.has_scan && check_rigid(T_map_body) == Status::kOk;
}

}  // namespace

DurableMap::DurableMap(MapName name, Robot& robot, const MapIdentity& identity)
    : name_(std::move(name)), robot_(robot), identity_(identity), submap_(robot.maps().number()) {
  state_.robot = name_.robot;
  state_.epoch = name_.epoch;
  state_.first = submap_;
}

Outcome<std::unique_ptr<DurableMap>> DurableMap::begin(const MapName& name, Robot& robot,
                                                       const MapIdentity& identity) {
  std::unique_ptr<DurableMap> made(new DurableMap(name, robot, identity));
  TESSERA_TRY_ASSIGN(made->journal_,
                     MapJournal::make(name.journal(made->submap_), robot.map(), identity, nullptr));
  return made;
}

Outcome<void> DurableMap::resume_journals(const FoundMap& found) {
  const auto read = [&](std::uint32_t submap) -> Outcome<std::unique_ptr<MapJournal>> {
    const std::string path = name_.journal(submap);
    TESSERA_TRY_ASSIGN(const JournalContent content,
                       read_journal(path, &robot_.mapper().map(), true));
    resumed_blocks_ += content.blocks;
    damaged_bytes_ += content.damaged_bytes;
    torn_bytes_ += content.torn_bytes;
    left_out_blocks_ += content.left_out;
    note_ = content.note.value_or(JournalNote{});
    return MapJournal::make(path, robot_.map(), identity_, &content);
  };
  if (found.journals.size() == 2) {
    ended_submap_ = found.journals.front().submap;
    TESSERA_TRY_ASSIGN(ended_, read(ended_submap_));
    const Outcome<JournalContent> next =
        read_journal(name_.journal(found.journals.back().submap), nullptr);
    const bool continues = !next.ok() || !next->note || next->note->continues;
    if (!robot_.mapper().resume_next(note_.submap, continues))
      return Failure{name_.journal(ended_submap_) + " is of a map in submaps; give " +
                     kMapSettings["--submap-length"]};
  }
  submap_ = robot_.maps().number();
  if (found.journals.empty()) {
    TESSERA_TRY_ASSIGN(journal_,
                       MapJournal::make(name_.journal(submap_), robot_.map(), identity_, nullptr));
    return {};
  }
  TESSERA_TRY_ASSIGN(journal_, read(submap_));
  if (note_.has_scan) robot_.mapper().resume(note_.submap);
  return {};
}

/// As many as there are submaps: what was not written any more continues the one before, or lies as
/// it was mapped.
Outcome<void> DurableMap::resume_frames(FoundMap& found, bool same_clock) {
  std::vector<SubmapFrame>& frames = found.state.frames;
  const std::size_t count = submap_ - found.state.first + std::size_t{1};
  frames.resize(std::min(frames.size(), count));
  while (frames.size() < count) {
    SubmapFrame next;
    next.continues = !frames.empty() && note_.continues;
    next.frame =
        next.continues ? frames.back().frame : *encode_rigid(Matrix34d(Matrix34d::Identity()));
    frames.push_back(next);
  }
  // Stamps of another clock would meet those of new poses by chance.
  for (SubmapFrame& frame : frames) {
    if (same_clock) continue;
    frame.count = frame.noted = 0;
    frame.stride = 1;
  }
  // A pose graph that was started with the machine counts its corrections from 1 again.
  const std::uint32_t revision = same_clock ? found.state.revision : 0;
  Status restored = robot_.sharer().restore_frames(frames, revision, found.has_frames);
  if (restored == Status::kInvalidArgument) {
    found.notes.push_back(name_.frames() +
                          " has a frame that is none or out of the grid: submaps "
                          "lie as they were mapped");
    for (SubmapFrame& frame : frames) {
      frame = {};
      frame.frame = *encode_rigid(Matrix34d(Matrix34d::Identity()));
    }
    restored = robot_.sharer().restore_frames(frames, 0, false);
  }
  return restored == Status::kOk
             ? Outcome<void>()
             : Failure{name_.frames() + " cannot be used: " + to_string(restored)};
}

Outcome<std::unique_ptr<DurableMap>> DurableMap::resume(FoundMap& found, Robot& robot,
                                                        const MapIdentity& identity,
                                                        bool same_clock) {
  std::unique_ptr<DurableMap> made(new DurableMap(found.name, robot, identity));
  TESSERA_TRY(made->resume_journals(found));
  TESSERA_TRY(made->resume_frames(found, same_clock));
  // The journal of the last pose may be gone with its submap.
  made->resumed_ = has_pose(made->note_) ? made->note_ : found.state.last;
  if (!has_pose(*made->resumed_)) made->resumed_.reset();
  if (made->resumed_ && !same_clock) made->resumed_->stamp_us = 0;
  made->state_ = found.state;
  made->state_.robot = found.name.robot;
  made->state_.epoch = found.name.epoch;
  return made;
}

/// The mapping thread has gone on to another submap.
Outcome<void> DurableMap::follow(std::uint32_t submap, const KeptSubmaps* kept) {
  if (submap != submap_) {
    if (!is_kept(kept, submap_)) {
      // Nobody writes to it any more.
      note_.submap = robot_.maps().note_of(submap_);
      TESSERA_TRY(journal_->step(note_));
    }
    TESSERA_TRY_ASSIGN(
        std::unique_ptr<MapJournal> next,
        MapJournal::make(name_.journal(submap), robot_.maps().of(submap), identity_, nullptr));
    ended_ = std::move(journal_);
    ended_submap_ = submap_;
    journal_ = std::move(next);
    submap_ = submap;
  }
  if (!ended_ || !is_kept(kept, ended_submap_)) return {};
  written_before_ += ended_->written_bytes();
  ended_->remove();
  ended_.reset();
  return {};
}

Outcome<void> DurableMap::keep_frames(const SubmapFramesState& frames, const KeptSubmaps* kept,
                                      std::int64_t now_us) {
  const bool poses_alone = frames.count == state_.frames.size() &&
                           frames.revision == state_.revision &&
                           (kept == nullptr || kept->rows().size() == state_.kept.size());
  if (poses_alone && now_us < poses_due_us_) return {};
  state_.in_submaps = kept != nullptr;
  state_.first = frames.first;
  state_.revision = frames.revision;
  state_.frames.assign(frames.frames.begin(), frames.frames.begin() + frames.count);
  if (kept != nullptr) state_.kept = kept->rows();
  if (note_.has_scan) state_.last = note_;
  state_.boot = boot_id();
  std::vector<std::byte> bytes = bytes_of(state_);
  if (bytes == state_bytes_) return {};
  poses_due_us_ = 0;
  TESSERA_TRY(write_submap_state(bytes, name_.frames()));
  state_bytes_ = std::move(bytes);
  const auto size = static_cast<std::int64_t>(state_bytes_.size());
  if (now_us != kAtEnd) poses_due_us_ = now_us + size * 1'000'000 / kFrameBytes_per_s;
  return {};
}

Outcome<void> DurableMap::keep(const MappingThreadState& mapping, const SubmapFramesState* frames,
                               const KeptSubmaps* kept, std::int64_t now_us) {
  if (mapping.cycles != 0) {
    TESSERA_TRY(follow(mapping.submap, kept));
    note_.has_scan = true;
    note_.submap = mapping.submap_note;
    note_.map_revision = mapping.map_revision;
    note_.stamp_us = mapping.stamp_us;
    note_.T_map_body = mapping.T_map_body;
    note_.continues = robot_.maps().before() != nullptr;
  }
  if (frames != nullptr && frames->count != 0) TESSERA_TRY(keep_frames(*frames, kept, now_us));
  if (mapping.clears != clears_) {
    TESSERA_TRY(journal_->begin_anew(note_));
    clears_ = mapping.clears;
    return {};
  }
  return journal_->step(note_);
}

std::uint64_t DurableMap::file_bytes() const noexcept {
  return journal_->file_bytes() + (ended_ ? ended_->file_bytes() : 0);
}

std::uint64_t DurableMap::written_bytes() const noexcept {
  return written_before_ + journal_->written_bytes() + (ended_ ? ended_->written_bytes() : 0);
}

std::uint64_t DurableMap::failed_renewals() const noexcept { return journal_->failed_renewals(); }

}  // namespace tessera
