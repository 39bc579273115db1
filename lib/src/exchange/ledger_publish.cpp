// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What this robot publishes: its contributions, and blocks in parts that each fit a datagram.
#include <algorithm>

#include "tessera/exchange/internal/ledger.hpp"

namespace tessera {

namespace {

/// A record that takes more is published in parts, of which any fits.
static_assert(most_coded_bytes(1) <= kMostCodedBytes);

/// The layers of one of so many parts.
constexpr std::uint8_t layers_of(unsigned part, unsigned parts) noexcept {
  const unsigned layers = static_cast<unsigned>(kBlockLayers) / parts;
  return static_cast<std::uint8_t>(((1U << layers) - 1U) << (part * layers));
}

}  // namespace

Status Ledger::open(std::uint32_t epoch, std::uint32_t submap, const Matrix34d& T_global_map,
                    ExchangeReport& counted) noexcept {
  const ContributionId id{robot_, epoch, submap};
  if (!GridTransform::make(T_global_map, resolution_m_).ok() || epoch < own_floor_)
    return Status::kInvalidArgument;
  first_epoch_ = std::min(first_epoch_, epoch);
  Contribution* known = find(id);
  if (known != nullptr && known->open) return Status::kInvalidArgument;
  // Whatever was said of it before was not said by this process.
  if (known != nullptr) drop(*known);
  Contribution* const contribution = add(id, Claim::kOwn, Instant::long_ago(), counted);
  if (contribution == nullptr) return Status::kResourceExhausted;
  const Status status = set_frame(*contribution, T_global_map, 1);
  if (status != Status::kOk) {
    drop(*contribution);
    return status;
  }
  contribution->own = true;
  ++opened_;
  if (overtaken_ && epoch > *overtaken_) overtaken_.reset();
  publishing_ = number_of(*contribution);
  return Status::kOk;
}

Status Ledger::move(std::uint32_t epoch, std::uint32_t submap,
                    const Matrix34d& T_global_map) noexcept {
  Contribution* const contribution = find({robot_, epoch, submap});
  if (contribution == nullptr || !contribution->own) return Status::kInvalidArgument;
  return set_frame(*contribution, T_global_map, contribution->frame_revision + 1);
}

Status Ledger::publish_parts(Contribution& contribution, BlockKey key, const BlockContent& content,
                             unsigned parts, std::size_t whole_bytes, std::uint32_t& bytes,
                             ExchangeReport& counted) noexcept {
  const std::uint32_t first = contribution.latest + 1;
  if (first > kLastVersion - parts) return Status::kResourceExhausted;
  for (unsigned part = 0; part < parts; ++part) {
    const std::uint8_t layers = layers_of(part, parts);
    // Of a whole block it is there already.
    const std::size_t coded = parts == 1 ? whole_bytes : encode_block(content, layers, coded_);
    content_.clear();
    if (const Status status = decode_block(coded_.first(coded), layers, num_components_, content_);
        status != Status::kOk)
      return status;
    ChunkRecord record{.block = unpack(key),
                       .version = {.number = first + part, .first = first, .layers = layers},
                       .coded = coded_.first(coded)};
    record.version.hash = record_hash(leaf_of(signatures_, contribution.id, record));
    const Result<Replicas::Change> change =
        put(contribution, key, record.version, content_, to_keep(record.coded, {}));
    if (!change.ok()) {
      ++counted.refused_parts;
      return change.status();
    }
    contribution.latest = record.version.number;
    contribution.coverage.add({1, contribution.latest});
    bytes += static_cast<std::uint32_t>(coded) + 8;
    ++counted.published_parts;
  }
  return Status::kOk;
}

Result<std::uint32_t> Ledger::publish(BlockKey key, const BlockContent& content,
                                      VersionRange& published, ExchangeReport& counted) noexcept {
  if (publishing_ == kNobody) return Status::kInvalidArgument;
  Contribution& contribution = contributions_[publishing_];
  const std::size_t whole = encode_block(content, kAllLayers, coded_);
  unsigned parts = 1;
  const auto fits = [&] {
    if (parts == 1) return whole <= kMostCodedBytes;
    if (parts == static_cast<unsigned>(kBlockLayers)) return true;
    for (unsigned part = 0; part < parts; ++part) {
      if (encode_block(content, layers_of(part, parts), coded_) > kMostCodedBytes) return false;
    }
    return true;
  };
  while (!fits()) parts *= 2;
  std::uint32_t bytes = 0;
  published.first = contribution.latest + 1;
  const Status status = publish_parts(contribution, key, content, parts, whole, bytes, counted);
  published.last = contribution.latest;
  if (status != Status::kOk) return status;
  return bytes;
}

bool Ledger::read_published(BlockKey key, BlockContent& content) const noexcept {
  if (publishing_ == kNobody) return false;
  const Slot slot = contributions_[publishing_].slot;
  bool any = false;
  for (const Replicas::Replica* part = store_.replicas->find(slot, key); part != nullptr;
       part = store_.replicas->next_part(*part)) {
    const auto is_live = [part](int row) { return ((part->live >> layer_of_row(row)) & 1U) != 0; };
    any = any || part->bytes != 0;
    unpack_block(
        store_.replicas->read(*part, packed_),
        [&](int row, int component, float count) {
          if (!is_live(row)) return;
          component == 0 ? content.add_rest(row, count) : content.add(component, row, count);
        },
        [&](int row, unsigned passes) {
          if (is_live(row)) content.add_passes(row, passes);
        });
  }
  return any;
}

}  // namespace tessera
