// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "node/earlier_submaps.hpp"

#include "maps/kept_submaps.hpp"

namespace tessera {

namespace {

constexpr std::int64_t kBetweenLooks_us = 1'000'000;

}  // namespace

EarlierSubmaps::EarlierSubmaps(std::string stem, std::span<const SubmapRow> rows)
    : stem_(std::move(stem)), done_(rows.size()) {
  for (const SubmapRow& row : rows) numbers_.push_back(row.number);
}

void EarlierSubmaps::tick(Sharer& sharer, std::int64_t now_us, std::uint64_t records) noexcept {
  if (begun_us_ == 0) begun_us_ = heard_us_ = now_us;
  if (records != records_) heard_us_ = now_us;
  records_ = records;
  if (const Job* const job = handed_.load(std::memory_order_acquire); job != nullptr)
    return work_on(sharer, *job);
  const bool is_time =
      now_us >= due_us_ && now_us - begun_us_ >= kPatience_us && now_us - heard_us_ >= kQuiet_us;
  if (!is_time) return;
  due_us_ = now_us + kBetweenLooks_us;
  want_next(sharer);
}

/// A few at a time, in turn: each takes a walk over all contributions.
void EarlierSubmaps::want_next(const Sharer& sharer) noexcept {
  for (std::size_t i = 0; i < std::min(kLookedAt, numbers_.size()); ++i) {
    const std::size_t at = next_++ % numbers_.size();
    if (done_[at].load(std::memory_order_acquire) || !sharer.is_missing(numbers_[at])) continue;
    return wanted_.store(at + 1, std::memory_order_release);
  }
}

void EarlierSubmaps::work_on(Sharer& sharer, const Job& job) noexcept {
  const Result<std::size_t> done =
      sharer.publish_earlier(numbers_[job.at], job.stored->map, job.blocks, block_, kBlocksOfTick);
  if (done.ok() && *done != 0) {
    block_ += *done;
    return;
  }
  published_.fetch_add(done.ok() ? 1U : 0U, std::memory_order_relaxed);
  block_ = 0;
  handed_.store(nullptr, std::memory_order_release);
}

Outcome<void> EarlierSubmaps::look() {
  if (job_) {
    if (handed_.load(std::memory_order_acquire) != nullptr) return {};
    done_[job_->at].store(true, std::memory_order_release);
    job_.reset();
    wanted_.store(0, std::memory_order_relaxed);
  }
  const std::size_t wanted = wanted_.load(std::memory_order_acquire);
  if (wanted == 0 || done_[wanted - 1].load(std::memory_order_relaxed)) return {};
  auto job = std::make_unique<Job>();
  job->at = wanted - 1;
  Outcome<std::unique_ptr<StoredMap>> stored =
      load_map(KeptSubmaps::path_of(stem_, numbers_[job->at]));
  if (!stored.ok()) {
    done_[job->at].store(true, std::memory_order_release);
    return stored.failure();
  }
  job->stored = std::move(*stored);
  job->workspace = workspace_for(job->stored->map);
  job->blocks = job->stored->map.blocks_in_order(job->workspace);
  job_ = std::move(job);
  handed_.store(job_.get(), std::memory_order_release);
  return {};
}

}  // namespace tessera
