// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The thread that shows a node's maps in browsers: it uses spare processor time, reads what the
// others write, and delays no other thread. It alone uses the heap after the start, a little for
// each request, and counts that.
#pragma once

#include <array>
#include <atomic>
#include <memory>

#include "base/duration_histogram.hpp"
#include "base/thread.hpp"
#include "node/doubt_watch.hpp"
#include "node/fleet_watch.hpp"
#include "node/frames_watch.hpp"
#include "node/mapping_thread.hpp"
#include "node/sharing_thread.hpp"
#include "view/viewer.hpp"

namespace tessera {

/// What is shown. All must outlive the thread and keep their addresses.
struct ViewedNode {
  std::uint32_t robot = 0;
  Matrix34d T_global_map = Matrix34d::Identity();
  std::int64_t period_us = 100'000;
  const LocalMaps* local = nullptr;
  const GlobalMap* global = nullptr;
  const MappingThread* mapping = nullptr;
  const SharingThread* sharing = nullptr;
  const NetworkPort* port = nullptr;
  const FleetWatch* fleet = nullptr;
  const DoubtWatch* doubts = nullptr;
  const FramesWatch* frames = nullptr;
};

class ViewThread {
 public:
  /// Positions of a robot's track that are kept; beyond that every other one is dropped.
  static constexpr std::size_t kTrack = 2048;

  /// Starts to listen. Fails as Viewer::open.
  static Outcome<std::unique_ptr<ViewThread>> open(const ViewerConfig& config,
                                                   const ViewedNode& node);
  ViewThread(const ViewThread&) = delete;
  ViewThread& operator=(const ViewThread&) = delete;
  ~ViewThread() { stop(); }

  Outcome<void> start(const ThreadRole& role);
  /// Nothing is answered before this.
  void begin() noexcept { begun_.store(true, std::memory_order_release); }
  /// Takes kTurn_ms, or the time of the current reply.
  void stop() noexcept;

  [[nodiscard]] std::string url() const { return viewer_->url(); }
  /// For any thread.
  [[nodiscard]] ViewerReport report() const noexcept { return viewer_->report(); }
  /// Heap allocations of this thread.
  [[nodiscard]] std::uint64_t heap_allocations() const noexcept {
    return heap_allocations_.load(std::memory_order_relaxed);
  }

 private:
  static constexpr int kTurn_ms = 20;

  ViewThread(const ViewedNode& node, double step_m) : node_(node), step_m_(step_m) {}
  void run() noexcept;
  void look() noexcept;
  void note_place(const std::array<double, 12>& T_map_sensor) noexcept;
  [[nodiscard]] Json status() const;
  [[nodiscard]] Json doubted_json() const;

  const ViewedNode node_;
  const double step_m_;  ///< Least time between two positions of the track.
  std::unique_ptr<Viewer> viewer_;
  MappingThreadState mapping_{};
  std::uint64_t unseen_ = 0;  ///< Cycles that ended between two turns.
  DurationHistogram cycles_;
  std::array<std::array<float, 3>, kTrack> track_{};
  std::size_t places_ = 0;
  std::size_t thinned_ = 0;  ///< Times that every other position was dropped.
  std::atomic<std::uint64_t> heap_allocations_{0};
  std::atomic<bool> begun_{false};
  std::atomic<bool> stopping_{false};
  Thread thread_;
};

}  // namespace tessera
