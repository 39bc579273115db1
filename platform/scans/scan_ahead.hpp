// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Reads the scans of a dataset, with their images and times, ahead of their use, as the time for
// reading files and images varies.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/spsc_queue.hpp"
#include "base/thread.hpp"
#include "base/wake_up.hpp"
#include "scans/dataset.hpp"

namespace tessera {

struct ScanToPlay {
  std::size_t scan = 0;  ///< Index in the dataset.
  std::vector<float> xyz;
  std::vector<std::uint8_t> components;
  std::vector<float> times_s;                     ///< Recorded, of each point; or empty.
  std::vector<std::vector<std::uint8_t>> images;  ///< Of each camera, a byte per pixel.
};

class ScanAhead {
 public:
  /// Number of scans that are read ahead.
  static constexpr std::size_t kSlots = 4;

  struct Source {
    const Dataset* dataset = nullptr;
    std::string dir;                         ///< Of the dataset.
    std::vector<CameraDescription> cameras;  ///< Whose images are read.
    bool with_times = false;                 ///< As Dataset::read_times.
    bool there_and_back = false;             ///< Forward and backward in turn.
  };
  /// source.dataset must outlive it.
  explicit ScanAhead(Source source);
  ~ScanAhead();
  ScanAhead(const ScanAhead&) = delete;
  ScanAhead& operator=(const ScanAhead&) = delete;

  /// Fails as Thread::start.
  Outcome<void> start();
  /// The next scan, from the first to the last, and with there_and_back then from the last to the
  /// first, and so on; waits until it is read. Do not call it for more scans than there are.
  /// Fails as Dataset::read and read_grey_png; do not call it again then.
  Outcome<std::unique_ptr<ScanToPlay>> next();

 private:
  struct Slot {
    std::unique_ptr<ScanToPlay> scan;
    std::optional<Failure> failure;
  };

  void run() noexcept;
  [[nodiscard]] Outcome<std::unique_ptr<ScanToPlay>> read(std::size_t i);

  const Source source_;
  ScanBuffer buffer_;
  SpscQueue<Slot> queue_;
  WakeUp reader_;
  WakeUp player_;
  std::atomic<bool> stopping_{false};
  Thread thread_;
};

}  // namespace tessera
