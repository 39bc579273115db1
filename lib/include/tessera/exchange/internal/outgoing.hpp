// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tessera/exchange/internal/repair.hpp"

namespace tessera {

/// A datagram that is being made, and what it is made with.
struct Outgoing {
  Gate& gate;
  Ledger& ledger;
  Repair& repair;
  Instant now;
  HashTree& tree;  ///< Scratch: of the records of a chunk and a statement, or of frames.
  ExchangeReport& counted;
  std::uint64_t data_sequence = 0;  ///< Of the last datagram with data.
  DatagramKind kind = DatagramKind::kAnnounce;
  std::uint32_t asker = 0;  ///< Who it is for, if for_asker.
  bool for_asker = false;
  bool needs_signature = false;  ///< Behind its body.
  Signature signature{};         ///< Of the tree.

  /// Signs the tree.
  void sign_root(const TreeOf& of) noexcept {
    const Signatures& signatures = gate.signatures();
    signatures.sign(signatures.context,
                    root_message(gate.configuration(), of, tree.count(), tree.root(signatures)),
                    signature);
  }
};

}  // namespace tessera
