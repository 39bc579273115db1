// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// An exchange as a Publisher sees it, what it says against others, and about frames.
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
  if (bytes.ok()) owe_latest(Objection::kNumber);
  return bytes;
}

Result<std::uint32_t> Exchange::state(const FrameLink& link) noexcept {
  const std::optional<ContributionId> now = publishing();
  std::array<std::byte, FrameLink::kBytes> bytes{};
  if (!now || link.from != robot_ || link.from_epoch != now->epoch ||
      encode_link(link, bytes) != Status::kOk)
    return Status::kInvalidArgument;
  return state(place_of_link(link.to), bytes);
}

Result<std::uint32_t> Exchange::state(const StatedPrior& prior) noexcept {
  const std::optional<ContributionId> now = publishing();
  std::array<std::byte, StatedPrior::kBytes> bytes{};
  if (!now || prior.robot != robot_ || prior.epoch != now->epoch ||
      encode_prior(prior, bytes) != Status::kOk)
    return Status::kInvalidArgument;
  return state(kPlaceOfPrior, bytes);
}

Result<std::uint32_t> Exchange::state(BlockKey place,
                                      std::span<const std::byte> statement) noexcept {
  const Result<std::uint32_t> bytes = ledger_.state(place, statement, counted_);
  if (bytes.ok()) owe_latest(FrameStatements::kNumber);
  return bytes;
}

/// Others ask for records that a statement tells them of; with the first one they need the frame.
void Exchange::owe_latest(std::uint32_t submap) noexcept {
  const std::uint32_t epoch = ledger_.publishing()->id.epoch;
  const Ledger::Contribution& own = *ledger_.find({robot_, epoch, submap});
  if (own.latest == 1) sender_.control().owe_frame(ledger_, own, Instant::long_ago());
  sender_.control().owe_statement(ledger_, own, Instant::long_ago());
}

}  // namespace tessera
