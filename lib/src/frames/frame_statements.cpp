// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/frames/frame_statements.hpp"

#include <algorithm>

#include "covariance_code.hpp"

namespace tessera {

namespace {

static_assert(StatedPrior::kBytes == 4 + 4 + 1 + kCovarianceBytes);

/// The robot that a link in this place is to. Nothing: no link stands there.
constexpr std::optional<std::uint32_t> linked_robot(BlockKey place) noexcept {
  const BlockCoord at = unpack(place);
  const auto robot = static_cast<std::uint32_t>(at.x) | static_cast<std::uint32_t>(at.y) << 16U;
  if (place != place_of_link(robot)) return std::nullopt;
  return robot;
}

/// What is held in a record. Replicas alone take any bytes, so that they are checked again.
template <std::size_t kBytes, class Decode>
auto decode_record(const Replicas& replicas, const Replicas::Replica& record,
                   Decode&& decode) noexcept -> decltype(decode(std::span<const std::byte>())) {
  std::array<std::byte, kBytes> bytes{};
  if (record.bytes != kBytes) return Status::kCorrupt;
  return decode(replicas.read(record, bytes));
}

/// Links of a contribution by ascending robot, of which the highest are forgotten.
struct LowestLinks {
  struct Link {
    std::uint32_t to = 0;
    std::uint32_t record = 0;  ///< A record's number.
  };
  std::array<Link, FrameStatements::kMostLinks> links{};
  std::uint32_t count = 0;

  void add(const Link& link, std::uint32_t most) noexcept {
    if (count == most && (most == 0 || links[count - 1].to < link.to)) return;
    count += count < most ? 1U : 0U;
    std::uint32_t at = count - 1;
    for (; at != 0 && link.to < links[at - 1].to; --at) links[at] = links[at - 1];
    links[at] = link;
  }
};

bool states_frames(const Replicas::Contribution& one) noexcept {
  return FrameStatements::is(one.id.submap) && !one.leaving;
}

std::uint32_t count_links(const Replicas& replicas, Replicas::Slot slot) noexcept {
  const std::uint32_t records = replicas.contribution(slot).blocks;
  return records - (replicas.find(slot, kPlaceOfPrior) != nullptr ? 1U : 0U);
}

/// Links that each contribution has room for, where there is room for so many in all.
struct Shares {
  std::uint32_t each = 0;   ///< Of every one.
  std::uint32_t spare = 0;  ///< The first so many that need it have one more.
};

/// As high as they go: O(contributions kMostLinks).
Shares share(const Replicas& replicas, std::size_t room) noexcept {
  std::array<std::uint32_t, FrameStatements::kMostLinks> with{};  // more than so many links
  for (const Replicas::Slot slot : replicas.in_order()) {
    if (!states_frames(replicas.contribution(slot))) continue;
    const std::uint32_t links = count_links(replicas, slot);
    for (std::uint32_t i = 0; i < std::min(links, FrameStatements::kMostLinks); ++i) ++with[i];
  }
  Shares shares;
  std::size_t left = room;
  while (shares.each < with.size() && with[shares.each] <= left) left -= with[shares.each++];
  shares.spare = static_cast<std::uint32_t>(left);
  return shares;
}

/// The lowest links of a contribution, of which there are at least count_links().
LowestLinks lowest_links(const Replicas& replicas, Replicas::Slot slot,
                         std::uint32_t most) noexcept {
  LowestLinks lowest;
  for (std::uint32_t number = replicas.contribution(slot).first_block; number != 0;) {
    const Replicas::Replica& record = replicas.record(number);
    const std::optional<std::uint32_t> to = linked_robot(BlockKey{record.key});
    if (to) lowest.add({*to, number}, most);
    number = record.next;
  }
  return lowest;
}

}  // namespace

Status encode_prior(const StatedPrior& prior,
                    std::span<std::byte, StatedPrior::kBytes> bytes) noexcept {
  if (prior.kind > PriorKind::kExact) return Status::kInvalidArgument;
  std::array<std::byte, StatedPrior::kBytes> made{};
  ByteWriter to(made);
  to.u32(prior.robot);
  to.u32(prior.epoch);
  to.u8(static_cast<std::uint8_t>(prior.kind));
  if (prior.kind == PriorKind::kVague && !write_covariance(to, prior.covariance))
    return Status::kInvalidArgument;
  TESSERA_ASSERT(to.ok());
  std::copy(made.begin(), made.end(), bytes.begin());
  return Status::kOk;
}

Result<StatedPrior> decode_prior(std::span<const std::byte> bytes) noexcept {
  if (bytes.size() < StatedPrior::kBytes) return Status::kTruncated;
  if (bytes.size() > StatedPrior::kBytes) return Status::kCorrupt;
  ByteReader from(bytes);
  StatedPrior prior;
  prior.robot = from.u32();
  prior.epoch = from.u32();
  const std::uint8_t kind = from.u8();
  if (kind > static_cast<std::uint8_t>(PriorKind::kExact)) return Status::kCorrupt;
  prior.kind = static_cast<PriorKind>(kind);
  if (prior.kind == PriorKind::kVague && !read_covariance(from, prior.covariance))
    return Status::kCorrupt;
  // One prior has one code, as a link has.
  std::array<std::byte, StatedPrior::kBytes> again{};
  if (encode_prior(prior, again) != Status::kOk ||
      !std::equal(again.begin(), again.end(), bytes.begin()))
    return Status::kCorrupt;
  return prior;
}

std::optional<FramePrior> prior_of(const StatedPrior& stated) noexcept {
  if (stated.kind == PriorKind::kUnknown) return std::nullopt;
  FramePrior prior;
  prior.robot = stated.robot;
  prior.exact = stated.kind == PriorKind::kExact;
  if (!prior.exact) prior.covariance = stated.covariance;
  return prior;
}

bool is_frame_statement(const ContributionId& id, BlockKey place,
                        std::span<const std::byte> bytes) noexcept {
  if (place == kPlaceOfPrior) {
    const Result<StatedPrior> prior = decode_prior(bytes);
    return prior.ok() && prior->robot == id.robot && prior->epoch == id.epoch;
  }
  const std::optional<std::uint32_t> to = linked_robot(place);
  if (!to) return false;
  const Result<FrameLink> link = decode_link(bytes);
  return link.ok() && link->from == id.robot && link->from_epoch == id.epoch && link->to == *to;
}

Result<StatedPrior> read_prior(const Replicas& replicas, Replicas::Slot slot) noexcept {
  const Replicas::Replica* const record = replicas.find(slot, kPlaceOfPrior);
  if (record == nullptr) return Status::kCorrupt;
  return decode_record<StatedPrior::kBytes>(replicas, *record, decode_prior);
}

CollectedStatements collect(const Replicas& replicas, std::span<FrameLink> links,
                            std::span<StatedPrior> priors) noexcept {
  CollectedStatements found;
  Shares shares = share(replicas, links.size());
  for (const Replicas::Slot slot : replicas.in_order()) {
    if (!states_frames(replicas.contribution(slot))) continue;
    if (replicas.find(slot, kPlaceOfPrior) != nullptr) {
      const Result<StatedPrior> prior = read_prior(replicas, slot);
      if (prior.ok() && found.priors < priors.size()) {
        priors[found.priors++] = *prior;
      } else {
        ++found.priors_left_out;
      }
    }
    const std::uint32_t all = count_links(replicas, slot);
    const bool gets_spare =
        all > shares.each && shares.each < FrameStatements::kMostLinks && shares.spare != 0;
    shares.spare -= gets_spare ? 1U : 0U;
    const LowestLinks lowest = lowest_links(replicas, slot, shares.each + (gets_spare ? 1U : 0U));
    found.links_left_out += all - lowest.count;
    for (std::uint32_t i = 0; i < lowest.count; ++i) {
      const auto& record = replicas.record(lowest.links[i].record);
      const auto link = decode_record<FrameLink::kBytes>(replicas, record, decode_link);
      if (link.ok()) {
        links[found.links++] = *link;
      } else {
        ++found.links_left_out;
      }
    }
  }
  return found;
}

}  // namespace tessera
