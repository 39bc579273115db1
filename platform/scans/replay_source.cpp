// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "scans/replay_source.hpp"

#include <algorithm>

#include "base/monotonic_clock.hpp"

namespace tessera {

namespace {

/// Interval at which a due scan is checked again if nothing wakes the thread.
constexpr std::int64_t kPatience_us = 100'000;

SlotCapacity capacity_of(const Dataset& dataset) {
  return {
      .points = std::max<std::size_t>(dataset.max_points(), 1), .cameras = 0, .image_pixels = 0};
}

}  // namespace

ReplaySource::ReplaySource(const Dataset& dataset, const ReplayConfig& config, WakeUp& mapping)
    : dataset_(dataset),
      config_(config),
      mapping_(mapping),
      buffer_(dataset.max_points()),
      queue_(kSlots) {
  while (ScanSlot* const slot = queue_.claim()) {
    *slot = ScanSlot(capacity_of(dataset));
    queue_.publish();
  }
  while (queue_.front() != nullptr) queue_.pop();
}

std::size_t ReplaySource::memory_bytes() const noexcept {
  return queue_.capacity() * ScanSlot::required_bytes(capacity_of(dataset_)) +
         dataset_.max_points() * (4 * sizeof(float) + 1);
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
  mapping_.wake();
}

bool ReplaySource::read_next() {
  ScanSlot* slot = queue_.claim();
  while (slot == nullptr) {
    reader_.sleep_until(MonotonicClock::now_us() + kPatience_us);
    if (stopping_.load(std::memory_order_acquire)) return false;
    slot = queue_.claim();
  }
  const Outcome<DatasetScan> scan = dataset_.read(next_, buffer_);
  if (!scan.ok()) {
    outcome_ = scan.failure();
    return false;
  }
  const std::size_t count = scan->num_points();
  const std::span<float> xyz = slot->xyz();
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      xyz[3 * i + axis] = scan->points_xyzi[4 * i + axis];
  }
  std::copy(scan->components.begin(), scan->components.end(), slot->components().begin());
  slot->count = static_cast<std::uint32_t>(count);
  slot->has_components = true;
  slot->T_map_body = slot->T_map_sensor = scan->T_map_sensor;
  // Counted from the first scan, so that delays do not add up.
  const std::uint64_t number = offered_.load(std::memory_order_relaxed);
  std::int64_t due_us = first_us_;
  if (config_.rate_hz > 0.0) due_us += microseconds(static_cast<double>(number) / config_.rate_hz);
  wait_until(due_us);
  if (stopping_.load(std::memory_order_acquire)) return false;
  slot->stamp_us = slot->taken_us = config_.rate_hz > 0.0 ? due_us : MonotonicClock::now_us();
  unknown_ids_.fetch_add(scan->unknown.points, std::memory_order_relaxed);
  queue_.publish();
  offered_.store(number + 1, std::memory_order_relaxed);
  mapping_.wake();
  next_ = (next_ + 1) % dataset_.num_scans();
  return next_ != 0 || config_.loop;
}

}  // namespace tessera
