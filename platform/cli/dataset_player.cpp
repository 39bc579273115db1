// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/dataset_player.hpp"

#include <time.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "posix/monotonic_clock.hpp"

namespace tessera {
namespace {

std::int64_t wall_now_us() {
  timespec now{};
  ::clock_gettime(CLOCK_REALTIME, &now);
  return std::int64_t{now.tv_sec} * 1'000'000 + std::int64_t{now.tv_nsec} / 1'000;
}

}  // namespace

DatasetPlayer::DatasetPlayer(const PlayerConfig& config, const Dataset& dataset,
                             std::unique_ptr<SensorSender> sender)
    : config_(config),
      dataset_(dataset),
      sender_(std::move(sender)),
      buffer_(dataset.max_points()) {}

Outcome<std::unique_ptr<DatasetPlayer>> DatasetPlayer::open(const PlayerConfig& config,
                                                            const Dataset& dataset) {
  Outcome<std::unique_ptr<SensorSender>> sender = SensorSender::open(config.url, config.interface);
  if (!sender.ok()) return sender.failure();
  return std::unique_ptr<DatasetPlayer>(new DatasetPlayer(config, dataset, std::move(*sender)));
}

std::int64_t DatasetPlayer::wait_until_due() {
  const std::int64_t period_us = microseconds(1.0 / config_.rate_hz);
  const std::int64_t now_us = MonotonicClock::now_us();
  due_us_ = due_us_ == 0 ? now_us : due_us_ + period_us;
  if (now_us > due_us_ + period_us) {
    // What was missed is not made up for: sensors do not either.
    ++report_.late;
    due_us_ = now_us;
  }
  const timespec until{due_us_ / 1'000'000, due_us_ % 1'000'000 * 1'000};
  while (::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) {
  }
  if (config_.clock == SensorClock::kMonotonic) return MonotonicClock::now_us();
  return wall_now_us();
}

Outcome<void> DatasetPlayer::send(const std::string& channel,
                                  const std::vector<std::byte>& message) {
  if (sender_->send(channel, message)) return {};
  return Failure{"cannot send to " + config_.url + ": " + std::strerror(errno) +
                     "; tessera doctor says how to mend it",
                 FailureKind::kFailure};
}

Outcome<void> DatasetPlayer::play(std::size_t i) {
  const Outcome<DatasetScan> scan = dataset_.read(i, buffer_);
  if (!scan.ok()) return scan.failure();
  xyz_.clear();
  for (std::size_t point = 0; point < scan->num_points(); ++point) {
    const std::span<const float> xyz = scan->points_xyzi.subspan(4 * point, 3);
    xyz_.insert(xyz_.end(), xyz.begin(), xyz.end());
  }
  const std::int64_t stamp_us = wait_until_due();
  if (config_.sends_poses) {
    if (check_rigid(scan->T_map_sensor) == Status::kOk) {
      const PoseMessage pose{.stamp_us = stamp_us,
                             .sequence = static_cast<std::int32_t>(report_.poses),
                             .quality = PoseQuality::kGood,
                             .T_map_body = scan->T_map_sensor,
                             .position_sigma_m = Point3d::Constant(-1.0),
                             .rotation_sigma_rad = -1.0};
      const Outcome<void> sent = send(config_.channels.pose, encode(pose));
      if (!sent.ok()) return sent.failure();
      ++report_.poses;
    } else {
      ++report_.bad_poses;
    }
  }
  // An empty list of components would make an empty scan one without labels.
  const bool semantic = config_.semantic && scan->num_points() > 0;
  CloudToSend cloud{.stamp_us = stamp_us, .sensor = config_.sensor, .xyz = xyz_};
  if (semantic) cloud.components = scan->components;
  const std::string& channel = semantic ? config_.channels.semantic_cloud : config_.channels.cloud;
  const Outcome<void> sent = send(channel, encode(cloud));
  if (sent.ok()) ++report_.scans;
  return sent;
}

}  // namespace tessera
