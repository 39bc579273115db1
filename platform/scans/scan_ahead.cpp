// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "scans/scan_ahead.hpp"

#include <utility>

#include "base/monotonic_clock.hpp"
#include "pictures/png_image.hpp"

namespace tessera {
namespace {

/// Interval at which a sleeping thread checks again if nothing wakes it.
constexpr std::int64_t kPatience_us = 100'000;

}  // namespace

ScanAhead::ScanAhead(Source source)
    : source_(std::move(source)), buffer_(source_.dataset->max_points()), queue_(kSlots) {}

ScanAhead::~ScanAhead() {
  stopping_.store(true, std::memory_order_release);
  reader_.wake();
  thread_.join();
}

Outcome<void> ScanAhead::start() {
  return thread_.start(
      {.name = "tessera-read"}, [](void* self) { static_cast<ScanAhead*>(self)->run(); }, this);
}

void ScanAhead::run() noexcept {
  const std::size_t num_scans = source_.dataset->num_scans();
  for (std::size_t i = 0; !stopping_.load(std::memory_order_acquire);
       i = (i + 1) % (2 * num_scans)) {
    if (i == num_scans && !source_.there_and_back) return;
    Outcome<std::unique_ptr<ScanToPlay>> scan = read(i < num_scans ? i : 2 * num_scans - 1 - i);
    Slot* slot = queue_.claim();
    for (; slot == nullptr; slot = queue_.claim()) {
      reader_.sleep_until(MonotonicClock::now_us() + kPatience_us);
      if (stopping_.load(std::memory_order_acquire)) return;
    }
    const bool done = scan.ok();
    if (done) {
      slot->scan = std::move(*scan);
    } else {
      slot->failure = scan.failure();
    }
    queue_.publish();
    player_.wake();
    if (!done) return;
  }
}

Outcome<std::unique_ptr<ScanToPlay>> ScanAhead::read(std::size_t i) {
  const Outcome<DatasetScan> scan = source_.dataset->read(i, buffer_);
  if (!scan.ok()) return scan.failure();
  auto to_play = std::make_unique<ScanToPlay>();
  to_play->scan = i;
  to_play->xyz.reserve(3 * scan->num_points());
  for (std::size_t point = 0; point < scan->num_points(); ++point) {
    const std::span<const float> xyz = scan->points_xyzi.subspan(4 * point, 3);
    to_play->xyz.insert(to_play->xyz.end(), xyz.begin(), xyz.end());
  }
  to_play->components.assign(scan->components.begin(), scan->components.end());
  if (source_.with_times) {
    to_play->times_s.resize(scan->num_points());
    const Outcome<void> timed = source_.dataset->read_times(i, to_play->times_s);
    if (!timed.ok()) return timed.failure();
  }
  for (const CameraDescription& camera : source_.cameras) {
    const ScanFilePath path(source_.dir, camera.folder, scan->number, ".png");
    const int width_px = camera.model.width_px();
    const int height_px = camera.model.height_px();
    std::vector<std::uint8_t>& image = to_play->images.emplace_back(
        static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px));
    const Outcome<void> decoded = read_grey_png(path.view(), width_px, height_px, image);
    if (!decoded.ok()) return decoded.failure();
  }
  return to_play;
}

Outcome<std::unique_ptr<ScanToPlay>> ScanAhead::next() {
  Slot* slot = queue_.front();
  for (; slot == nullptr; slot = queue_.front())
    player_.sleep_until(MonotonicClock::now_us() + kPatience_us);
  if (slot->failure) return *slot->failure;
  std::unique_ptr<ScanToPlay> scan = std::move(slot->scan);
  queue_.pop();
  reader_.wake();
  return scan;
}

}  // namespace tessera
