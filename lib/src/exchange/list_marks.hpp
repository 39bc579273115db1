// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tessera/exchange/internal/held_records.hpp"

namespace tessera {

/// Fills into with the records of a span, ascending; of more than fit those with the lowest
/// versions. Only who publishes a version twice has several blocks of it, which are one entry: who
/// lacks one asks for all. last: in: the last version of interest; out: up to which the list is
/// whole, at least the first. visited: grows by the records that were looked at. into: not empty.
std::size_t list_marks(const HeldRecords& records, const HeldContribution& contribution,
                       const VersionSpan& span, std::uint32_t& last,
                       std::span<Description::Mark> into, std::size_t& visited) noexcept;

}  // namespace tessera
