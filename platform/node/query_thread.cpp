// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "node/query_thread.hpp"

namespace tessera {

Outcome<std::unique_ptr<QueryThread>> QueryThread::open(const QueryPortConfig& config,
                                                        const ServedMaps& maps) {
  TESSERA_TRY_ASSIGN(std::unique_ptr<QueryPort> port, QueryPort::open(config, maps));
  return std::unique_ptr<QueryThread>(new QueryThread(std::move(port)));
}

Outcome<void> QueryThread::start(const ThreadRole& role) {
  return thread_.start(
      role, [](void* self) { static_cast<QueryThread*>(self)->run(); }, this);
}

void QueryThread::stop() noexcept {
  stopping_.store(true, std::memory_order_release);
  thread_.join();
}

void QueryThread::run() noexcept {
  while (!stopping_.load(std::memory_order_acquire)) static_cast<void>(port_->serve(kTurn_us));
}

}  // namespace tessera
