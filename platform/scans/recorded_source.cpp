// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "scans/recorded_source.hpp"

namespace tessera {

RecordedSource::RecordedSource(const RecordedScans& scans, ScanOrder order, Registrar* registrar)
    : scans_(scans),
      order_(order),
      registrar_(registrar),
      scan_(scans.registration().limits),
      ended_(scans.num_scans() == 0) {}

std::size_t RecordedSource::place() const noexcept {
  const std::size_t count = scans_.num_scans();
  return next_ < count ? next_ : 2 * count - 1 - next_;
}

Outcome<void> RecordedSource::read_scan() {
  Outcome<void> done = scans_.read(place(), scan_);
  if (!done.ok() || registrar_ == nullptr) return done;
  ScanView view;
  if (!registrar_->view(scan_, view)) return does_not_suit(scan_);
  if (scan_.kind == ScanKind::kDepthImage) scan_.become_cloud(view);
  return done;
}

Scan* RecordedSource::front() noexcept {
  if (ended_) return nullptr;
  if (is_read_) return &scan_;
  outcome_ = read_scan();
  if (!outcome_.ok()) {
    ended_ = true;
    return nullptr;
  }
  is_read_ = true;
  ++counters_.offered;
  counters_.unknown_ids += scan_.unknown.points;
  return &scan_;
}

void RecordedSource::pop() noexcept {
  if (!is_read_) return;
  is_read_ = false;
  const std::size_t count = scans_.num_scans();
  const std::size_t pass = order_ == ScanOrder::kThereAndBack ? 2 * count : count;
  next_ = (next_ + 1) % pass;
  ended_ = next_ == 0 && order_ == ScanOrder::kOnce;
}

}  // namespace tessera
