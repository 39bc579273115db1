// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// An exchange as a Publisher sees it, and what it says against others.
#include <algorithm>

#include "tessera/base/internal/bits.hpp"
#include "tessera/exchange/exchange.hpp"

namespace tessera {

namespace {

/// Of the bytes of a block, what its free-only voxels take, as real maps have it.
std::uint32_t free_bytes(const BlockContent& content, std::uint32_t bytes) noexcept {
  constexpr std::uint32_t kVoxelsOfByte = 14;
  const std::uint64_t labelled = content.label_octets();
  if (labelled == 0) return bytes;
  const auto octets = static_cast<std::uint32_t>(count_ones(content.pass_octets() & ~labelled));
  return std::min(bytes, octets * kOctetVoxels / kVoxelsOfByte);
}

}  // namespace

/// Named, so that the gate of the stack knows who calls them.
struct ExchangePublication {
  static void quantise(void* /*context*/, BlockContent& content) { tessera::quantise(content); }
  static bool read(void* context, BlockKey key, BlockContent& content) {
    return static_cast<const Exchange*>(context)->read_published(key, content);
  }
  static Result<WireBytes> publish(void* context, BlockKey key, const BlockContent& content) {
    const Result<std::uint32_t> bytes = static_cast<Exchange*>(context)->publish(key, content);
    if (!bytes.ok()) return bytes.status();
    const std::uint32_t free = free_bytes(content, *bytes);
    return WireBytes{.labels = *bytes - free, .free = free};
  }
};

Publication publication_of(Exchange& exchange) noexcept {
  return {.context = &exchange,
          .quantise = ExchangePublication::quantise,
          .read = ExchangePublication::read,
          .publish = ExchangePublication::publish};
}

Result<std::uint32_t> Exchange::object(const Objection& objection) noexcept {
  const Result<std::uint32_t> bytes = ledger_.object(objection, counted_);
  if (!bytes.ok()) return bytes;
  const std::uint32_t epoch = ledger_.publishing()->id.epoch;
  const Ledger::Contribution& own = *ledger_.find({robot_, epoch, Objection::kNumber});
  if (own.latest == 1) sender_.control().owe_frame(ledger_, own, Instant::long_ago());
  sender_.control().owe_statement(ledger_, own, Instant::long_ago());
  return bytes;
}

}  // namespace tessera
