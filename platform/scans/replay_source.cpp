// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "scans/replay_source.hpp"

#include <utility>

#include "base/monotonic_clock.hpp"

namespace tessera {

namespace {

/// Interval at which a due scan is checked again if nothing wakes the thread.
constexpr std::int64_t kPatience_us = 100'000;

}  // namespace

ReplaySource::ReplaySource(const RecordedScans& scans, const ReplayConfig& config, WakeUp& user,
                           Registrar* registrar)
    : config_(config),
      limits_(scans.registration().limits),
      user_(user),
      from_(scans, config.order, registrar),
      queue_(kSlots) {
  while (Scan* const slot = queue_.claim()) {
    *slot = Scan(limits_);
    queue_.publish();
  }
  while (queue_.front() != nullptr) queue_.pop();
}

std::size_t ReplaySource::memory_bytes() const noexcept {
  return (queue_.capacity() + 1) * Scan::required_bytes(limits_);
}

Outcome<void> ReplaySource::start(const ThreadRole& role, std::int64_t start_us) {
  first_us_ = start_us + microseconds(config_.start_delay_s);
  return thread_.start(
      role, [](void* self) { static_cast<ReplaySource*>(self)->read_until_stopped(); }, this);
}

void ReplaySource::stop() noexcept {
  stopping_.store(true, std::memory_order_release);
  reader_.wake();
  thread_.join();
}

void ReplaySource::wait_until(std::int64_t us) noexcept {
  while (!stopping_.load(std::memory_order_acquire) && MonotonicClock::now_us() < us)
    reader_.sleep_until(us);
}

void ReplaySource::read_until_stopped() noexcept {
  while (!stopping_.load(std::memory_order_acquire) && read_next()) {
  }
  read_all_.store(true, std::memory_order_release);
  user_.wake();
}

bool ReplaySource::read_next() noexcept {
  Scan* slot = queue_.claim();
  while (slot == nullptr) {
    reader_.sleep_until(MonotonicClock::now_us() + kPatience_us);
    if (stopping_.load(std::memory_order_acquire)) return false;
    slot = queue_.claim();
  }
  Scan* const scan = from_.front();
  if (scan == nullptr) return false;
  std::swap(*slot, *scan);
  from_.pop();
  // Counted from the first scan, so that delays do not add up.
  const std::uint64_t number = offered_.load(std::memory_order_relaxed);
  std::int64_t due_us = first_us_;
  if (config_.rate_hz > 0.0) due_us += microseconds(static_cast<double>(number) / config_.rate_hz);
  wait_until(due_us);
  if (stopping_.load(std::memory_order_acquire)) return false;
  slot->taken_us = config_.rate_hz > 0.0 ? due_us : MonotonicClock::now_us();
  unknown_ids_.fetch_add(slot->unknown.points, std::memory_order_relaxed);
  queue_.publish();
  offered_.store(number + 1, std::memory_order_relaxed);
  user_.wake();
  return !from_.ended();
}

}  // namespace tessera
