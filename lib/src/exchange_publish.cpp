// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A block into this robot's own replicas, in parts that each fit a datagram.
#include <algorithm>

#include "tessera/base/bits.hpp"
#include "tessera/exchange/block_codec.hpp"
#include "tessera/exchange/exchange.hpp"
#include "tessera/map/packed_block.hpp"

namespace tessera {

namespace {

/// The layers of one of so many parts.
constexpr std::uint8_t layers_of(unsigned part, unsigned parts) noexcept {
  const unsigned layers = static_cast<unsigned>(kBlockLayers) / parts;
  return static_cast<std::uint8_t>(((1U << layers) - 1U) << (part * layers));
}

}  // namespace

Status Exchange::publish_parts(Contribution& contribution, BlockKey key,
                               const BlockContent& content, unsigned parts, std::size_t whole_bytes,
                               std::uint32_t& bytes) noexcept {
  const std::uint32_t first = contribution.latest + 1;
  for (unsigned part = 0; part < parts; ++part) {
    const std::uint8_t layers = layers_of(part, parts);
    // Of a whole block it is there already.
    const std::size_t coded = parts == 1 ? whole_bytes : encode_block(content, layers, coded_);
    content_.clear();
    if (const Status status = decode_block(coded_.first(coded), layers, num_components_, content_);
        status != Status::kOk)
      return status;
    const PartVersion version{.number = first + part, .first = first, .layers = layers};
    const Result<Replicas::Change> change =
        put(contribution, key, version, content_, to_keep(coded_.first(coded), {}));
    if (!change.ok()) {
      ++counted_.refused_parts;
      return change.status();
    }
    contribution.latest = version.number;
    contribution.coverage.add({1, version.number});
    note_fresh(key, version.number);
    bytes += static_cast<std::uint32_t>(coded) + 8;
    ++counted_.published_parts;
  }
  return Status::kOk;
}

void Exchange::note_fresh(BlockKey key, std::uint32_t version) noexcept {
  if (fresh_count_ == fresh_.size()) {
    fresh_first_ = (fresh_first_ + 1) % fresh_.size();
    --fresh_count_;
  }
  fresh_[(fresh_first_ + fresh_count_++) % fresh_.size()] = {key, version};
}

/// As collect(), of what was published last: O(kMostParts), or what collect() takes where more
/// waits than is noted.
void Exchange::collect_fresh(Batch& batch) noexcept {
  if (fresh_count_ == 0 || fresh_[fresh_first_].version != batch.range.first) {
    if (fresh_count_ != 0) batch.range.last = fresh_[fresh_first_].version - 1;
    collect(batch);
    return;
  }
  batch.count = batch.next = 0;
  const Slot slot = contributions_[batch.contribution].slot;
  while (fresh_count_ != 0 && batch.count < Batch::kMostParts) {
    const Fresh& fresh = fresh_[fresh_first_];
    const Replicas::Replica* part = store_.replicas->find(slot, fresh.key);
    while (part != nullptr && (part->version != fresh.version || part->live == 0))
      part = store_.replicas->next_part(*part);
    // Else it is superseded already.
    if (part != nullptr && part->latest())
      batch.parts[batch.count++] = {store_.replicas->number_of(*part), fresh.version};
    batch.range.last = fresh.version;
    fresh_first_ = (fresh_first_ + 1) % fresh_.size();
    --fresh_count_;
  }
}

Result<std::uint32_t> Exchange::publish(BlockKey key, const BlockContent& content) noexcept {
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
  const Status status = publish_parts(contribution, key, content, parts, whole, bytes);
  announce_soon_ = announce_soon_ || bytes != 0;
  if (status != Status::kOk) return status;
  return bytes;
}

bool Exchange::read_published(BlockKey key, BlockContent& content) const noexcept {
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
          .publish = ExchangePublication::publish,
          .whole = nullptr};
}

}  // namespace tessera
