// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "node/session_loader.hpp"

#include <fmt/core.h>

#include <algorithm>

namespace tessera {

namespace {

/// What follows the name of a file.
std::string why_refused(Status status) {
  if (status == Status::kResourceExhausted)
    return " has no place: give a larger [network] contributions";
  if (status == Status::kUnsupported)
    return " needs a robot whose frame is known: [fusion] frames = \"given\", or \"refined\" from "
           "an "
           "exact one, with frame_sigma_m = 0 and frame_sigma_deg = 0";
  return std::string(" is refused: ") + to_string(status);
}

}  // namespace

SessionLoader::SessionLoader(const std::vector<SessionOptions>& wanted) {
  for (const SessionOptions& options : wanted) items_.push_back({.options = options});
}

// --- In the sharing thread -----------------------------------------------------------------------

void SessionLoader::tick(Sharer& sharer) noexcept {
  if (const std::uint32_t epochs = sharer.submap().reopened; epochs != epochs_.load()) {
    has_ended_earlier_ = false;
    epochs_.store(epochs, std::memory_order_release);
  }
  if (Job* const job = handed_.load(std::memory_order_acquire); job != nullptr)
    return work_on(sharer, *job);
  if (has_ended_earlier_ || !is_loaded()) return;
  sharer.sessions().end_earlier();
  has_ended_earlier_ = true;
}

void SessionLoader::work_on(Sharer& sharer, Job& job) noexcept {
  MapSessions& sessions = sharer.sessions();
  if (job.removes) return end_job(job, sessions.remove(job.submap));
  const SessionFile& file = job.file;
  if (!job.is_open) {
    const Result<std::uint32_t> opened =
        sessions.open(file.stored->map, file.session, file.T_global_map);
    if (!opened.ok()) return end_job(job, opened.status());
    job.submap = *opened;
    job.is_open = true;
    return;
  }
  const Result<std::size_t> done =
      sessions.publish(job.submap, file.stored->map, file.blocks, job.next_block, kBlocksOfTick);
  if (done.ok() && *done != 0) {
    job.next_block += *done;
    return;
  }
  for (const MapSessions::Session& one : sessions.all())
    if (one.submap == job.submap) job.done = one;
  end_job(job, done.status());
}

void SessionLoader::end_job(Job& job, Status status) noexcept {
  job.status = status;
  handed_.store(nullptr, std::memory_order_release);
}

// --- In the thread that reads --------------------------------------------------------------------

void SessionLoader::hand(std::unique_ptr<Job> job) {
  job_ = std::move(job);
  handed_.store(job_.get(), std::memory_order_release);
}

SessionLoader::News SessionLoader::look(const MapConfig& map, const ClassTable& classes) {
  if (handed_.load(std::memory_order_acquire) != nullptr) return {};
  if (job_) return take_result();
  if (const std::uint32_t epochs = epochs_.load(std::memory_order_acquire);
      epochs != epochs_seen_) {
    epochs_seen_ = epochs;
    for (Item& item : items_)
      if (item.state == State::kShared) item.state = State::kWaiting;
  }
  for (std::size_t i = 0; i < items_.size(); ++i) {
    if (items_[i].state == State::kUnwanted) {
      auto job = std::make_unique<Job>();
      job->item = i;
      job->removes = true;
      job->submap = items_[i].submap;
      hand(std::move(job));
      return {};
    }
    if (items_[i].state == State::kWaiting) return begin(i, map, classes);
  }
  loaded_for_.store(std::uint64_t{epochs_seen_} + 1, std::memory_order_release);
  return {};
}

SessionLoader::News SessionLoader::leave_out(Item& item, std::string why) {
  item.state = State::kLeftOut;
  item.why = std::move(why);
  return {true, "a session is left out: " + item.why};
}

SessionLoader::News SessionLoader::begin(std::size_t number, const MapConfig& map,
                                         const ClassTable& classes) {
  Item& item = items_[number];
  Outcome<SessionFile> file = load_session(item.options);
  if (!file.ok()) return leave_out(item, file.failure().text(Speaker::kFile));
  if (const Outcome<void> fits = check_session(*file, map, classes); !fits.ok())
    return leave_out(item, fits.failure().text(Speaker::kFile));
  item.session = file->session;
  const auto is_same = [&](const Item& other) {
    return &other != &item && other.state == State::kShared &&
           other.session.digest == item.session.digest;
  };
  const auto same = std::find_if(items_.begin(), items_.end(), is_same);
  if (same != items_.end())
    return leave_out(item, fmt::format("{} has the same content as {}; name one of them",
                                       item.options.file, same->options.file));
  auto job = std::make_unique<Job>();
  job->item = number;
  job->file = std::move(*file);
  hand(std::move(job));
  return {};
}

SessionLoader::News SessionLoader::take_result() {
  const std::unique_ptr<Job> job = std::move(job_);
  Item& item = items_[job->item];
  if (job->removes) {
    const std::string file = item.options.file;
    items_.erase(items_.begin() + static_cast<std::ptrdiff_t>(job->item));
    return {false, "session " + file + " is removed"};
  }
  if (item.state == State::kUnwanted && !job->is_open) {
    items_.erase(items_.begin() + static_cast<std::ptrdiff_t>(job->item));
    return {};
  }
  // In another epoch it is opened again.
  if (epochs_.load(std::memory_order_acquire) != epochs_seen_) return {};
  if (!job->is_open) return leave_out(item, item.options.file + why_refused(job->status));
  // What was taken out of the configuration meanwhile is removed next.
  if (item.state == State::kWaiting) item.state = State::kShared;
  item.submap = job->submap;
  item.blocks = job->done.blocks;
  item.refused_blocks = job->done.refused_blocks;
  const std::string what =
      fmt::format("session {} of {}, digest {}: {} blocks with weight {} are shared",
                  item.options.file, date_text(item.session.date_s), hex64(item.session.digest),
                  item.blocks, weight_of(item.session));
  if (item.refused_blocks == 0) return {false, what};
  return {true, fmt::format("{}, {} have no room; give a larger [fusion] memory or robot_share",
                            what, item.refused_blocks)};
}

void SessionLoader::want(const std::vector<SessionOptions>& wanted) {
  std::vector<Item> kept;
  const Item* const handed = job_ ? &items_[job_->item] : nullptr;
  for (Item& item : items_) {
    const bool is_wanted = std::find(wanted.begin(), wanted.end(), item.options) != wanted.end();
    const bool is_handed = &item == handed;
    if (!is_wanted && (item.state == State::kShared || is_handed)) item.state = State::kUnwanted;
    if (is_handed) job_->item = kept.size();
    if (is_wanted || item.state == State::kUnwanted) kept.push_back(std::move(item));
  }
  items_ = std::move(kept);
  for (const SessionOptions& options : wanted) {
    const auto is_this = [&](const Item& item) {
      return item.options == options && item.state != State::kUnwanted;
    };
    if (std::none_of(items_.begin(), items_.end(), is_this)) items_.push_back({.options = options});
  }
}

Json SessionLoader::report() const {
  std::uint64_t left_out = 0;
  std::uint64_t refused_blocks = 0;
  Json files = Json::array();
  for (const Item& item : items_) {
    const bool is_left_out = item.state == State::kLeftOut;
    left_out += is_left_out ? 1U : 0U;
    refused_blocks += item.refused_blocks;
    const bool is_read = item.session.weight != 0;
    Json one = is_read ? to_json(item.session) : Json{{"digest", nullptr}, {"date", nullptr}};
    one["weight"] = item.options.weight;
    one["file"] = item.options.file;
    one["state"] = is_left_out ? "left out" : item.state == State::kShared ? "shared" : "waiting";
    one["why"] = item.why;
    one["blocks"] = item.blocks;
    one["refused_blocks"] = item.refused_blocks;
    files.push_back(std::move(one));
  }
  return {{"left_out", left_out}, {"refused_blocks", refused_blocks}, {"files", std::move(files)}};
}

}  // namespace tessera
