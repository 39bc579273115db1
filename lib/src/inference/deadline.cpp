// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/inference/deadline.hpp"

#include <limits>

namespace tessera {

std::int64_t Deadline::left_us() noexcept {
  if (clock_.now_us == nullptr) return std::numeric_limits<std::int64_t>::max();
  ++readings_;
  const std::int64_t left = due_us_ - clock_.now_us(clock_.context);
  past_ = left <= 0;
  return left;
}

void Deadline::begin(std::int64_t due_us) noexcept {
  due_us_ = due_us;
  overshoot_us_ = 0;
  measuring_ = past_ = false;
}

std::uint64_t Deadline::begin_work() noexcept {
  left_at_start_us_ = left_us();
  measuring_ = true;
  if (left_at_start_us_ <= 0) return 0;
  constexpr double kMost = 1e18;
  const double work = rate() * static_cast<double>(left_at_start_us_);
  return static_cast<std::uint64_t>(work < kMost ? work : kMost);
}

bool Deadline::allows(std::uint64_t work) noexcept {
  const std::int64_t left = left_us();
  return left > 0 && static_cast<double>(work) <= rate() * static_cast<double>(left);
}

void Deadline::end(std::uint64_t work) noexcept {
  if (clock_.now_us == nullptr) return;
  const std::int64_t left = left_us();
  overshoot_us_ = left < 0 ? -left : 0;
  if (!measuring_ || work == 0) return;
  // Less than a tick of the clock counts as one.
  const std::int64_t taken = left_at_start_us_ - left;
  samples_[next_] = {static_cast<double>(work), static_cast<double>(taken > 0 ? taken : 1)};
  next_ = (next_ + 1) % kWindow;
}

double Deadline::rate() const noexcept {
  Sample sum;
  for (const Sample& sample : samples_) {
    sum.work += sample.work;
    sum.time_us += sample.time_us;
  }
  return sum.time_us > 0.0 ? kMargin * (sum.work / sum.time_us) : first_rate_;
}

}  // namespace tessera
