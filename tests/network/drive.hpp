// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A robot that maps recorded scans one after the other, and publishes what the publisher chooses.
#pragma once

#include <memory>

#include "scans/dataset.hpp"
#include "support/mapper.hpp"
#include "tessera/exchange/exchange.hpp"
#include "tessera/exchange/publisher.hpp"

namespace tessera::network {

class Drive {
 public:
  /// Of so many scans of the dataset, which must outlive it. Throws std::runtime_error iff there is
  /// no room for what it needs.
  Drive(const Dataset& dataset, std::size_t first, std::size_t count);
  /// Throws std::runtime_error iff a scan cannot be read or does not fit.
  void integrate_next();
  [[nodiscard]] bool is_over() const { return next_ == end_; }
  /// Publishes what is due.
  void tick(std::int64_t now_us, Exchange& exchange);
  [[nodiscard]] const PublisherTotals& totals() const { return publisher_.totals(); }

 private:
  std::size_t next_;
  std::size_t end_;
  ScanReader reader_;
  AlignedMemory memory_;
  Mapper* mapper_ = nullptr;
  Publisher publisher_;
};

}  // namespace tessera::network
