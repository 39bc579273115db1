// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Signatures that hold as long as nobody looks how they are made: for simulated robots that are
// honest about that.
#pragma once

#include <cstdint>

#include "tessera/exchange/signatures.hpp"

namespace tessera::network {

class ToySignatures {
 public:
  explicit ToySignatures(std::uint32_t robot) : robot_(robot) {}
  /// This must stay where it is.
  [[nodiscard]] Signatures signatures();
  [[nodiscard]] std::uint64_t checks() const { return checks_; }

 private:
  std::uint32_t robot_;
  std::uint64_t checks_ = 0;
};

}  // namespace tessera::network
