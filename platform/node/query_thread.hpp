// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The thread that answers planners: it uses spare processor time, reads the maps while they are
// written, and delays no other thread.
#pragma once

#include <atomic>
#include <memory>

#include "base/thread.hpp"
#include "node/query_port.hpp"

namespace tessera {

class QueryThread {
 public:
  /// Fails as QueryPort::open. maps: must outlive it and keep their addresses.
  static Outcome<std::unique_ptr<QueryThread>> open(const QueryPortConfig& config,
                                                    const ServedMaps& maps);
  QueryThread(const QueryThread&) = delete;
  QueryThread& operator=(const QueryThread&) = delete;
  ~QueryThread() { stop(); }

  Outcome<void> start(const ThreadRole& role);
  /// Takes at most kTurn_us.
  void stop() noexcept;
  /// For any thread.
  [[nodiscard]] QueryPortReport report() const noexcept { return port_->report(); }
  [[nodiscard]] const LatestValue<AskedPlaces>& asked() const noexcept { return port_->asked(); }

 private:
  static constexpr std::int64_t kTurn_us = 50'000;

  explicit QueryThread(std::unique_ptr<QueryPort> port) : port_(std::move(port)) {}
  void run() noexcept;

  std::unique_ptr<QueryPort> port_;
  std::atomic<bool> stopping_{false};
  Thread thread_;
};

}  // namespace tessera
