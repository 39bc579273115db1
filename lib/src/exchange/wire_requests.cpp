// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Requests and descriptions.
#include "tessera/exchange/wire.hpp"
#include "wire_numbers.hpp"

namespace tessera {

using namespace wire;

namespace {

/// Flag of a description.
constexpr std::uint8_t kIsList = 0x80;
/// Flag beside the type of a request.
constexpr std::uint8_t kHasStatement = 0x80;

}  // namespace

namespace {

std::size_t bytes_of_request(const RequestedContribution& requested) noexcept {
  const std::size_t head = kIdBytes + 4 + 1 + (requested.stated ? 4U : 0U) + 1;
  switch (requested.type) {
    case RequestType::kGaps:
      return head + std::size_t{8} * requested.count;
    case RequestType::kVersions:
      return head + 4 + ascending_bytes(std::span(requested.version).first(requested.count));
    case RequestType::kDescribe:
      return head + 5 + ascending_bytes(std::span(requested.span).first(requested.count));
  }
  return head;
}

bool read_gaps(ByteReader& from, RequestedContribution& requested) noexcept {
  if (requested.count > RequestedContribution::kMostGaps) return false;
  std::uint32_t before = 0;
  for (VersionRange& gap : std::span(requested.gap).first(requested.count)) {
    gap.first = from.u32();
    gap.last = from.u32();
    if (gap.first <= before || !is_range(gap)) return false;
    before = gap.last;
  }
  return from.ok();
}

bool read_versions(ByteReader& from, RequestedContribution& requested) noexcept {
  if (requested.count > RequestedContribution::kMostVersions) return false;
  const auto versions = std::span(requested.version).first(requested.count);
  if (!read_ascending(from, versions)) return false;
  return versions.empty() || (versions.front() >= 1 && versions.back() <= kLastVersion);
}

bool read_spans(ByteReader& from, RequestedContribution& requested) noexcept {
  requested.width = from.u8();
  if (requested.count > RequestedContribution::kMostSpans || requested.width > 32) return false;
  const auto spans = std::span(requested.span).first(requested.count);
  return from.ok() && read_ascending(from, spans) &&
         (spans.empty() || is_span({requested.width, spans.back()}));
}

}  // namespace

bool write_requested(ByteWriter& to, const RequestedContribution& requested) noexcept {
  if (to.room() < bytes_of_request(requested)) return false;
  write_id(to, requested.id);
  to.u32(requested.frame_revision);
  to.u8(static_cast<std::uint8_t>(static_cast<std::uint8_t>(requested.type) |
                                  (requested.stated ? kHasStatement : 0)));
  if (requested.stated) to.u32(requested.latest);
  to.u8(requested.count);
  if (requested.type != RequestType::kGaps) to.u32(requested.target);
  switch (requested.type) {
    case RequestType::kGaps:
      for (const VersionRange& gap : std::span(requested.gap).first(requested.count)) {
        to.u32(gap.first);
        to.u32(gap.last);
      }
      break;
    case RequestType::kVersions:
      write_ascending(to, std::span(requested.version).first(requested.count));
      break;
    case RequestType::kDescribe:
      to.u8(requested.width);
      write_ascending(to, std::span(requested.span).first(requested.count));
      break;
  }
  return true;
}

bool read_requested(ByteReader& from, RequestedContribution& requested) noexcept {
  read_id(from, requested.id);
  requested.frame_revision = from.u32();
  const std::uint8_t type = from.u8();
  requested.stated = (type & kHasStatement) != 0;
  if ((type & ~kHasStatement) > static_cast<std::uint8_t>(RequestType::kDescribe)) return false;
  requested.type = static_cast<RequestType>(type & ~kHasStatement);
  requested.latest = requested.stated ? from.u32() : 0;
  requested.count = from.u8();
  requested.target = requested.type == RequestType::kGaps ? 0 : from.u32();
  if (!from.ok()) return false;
  switch (requested.type) {
    case RequestType::kGaps:
      return read_gaps(from, requested);
    case RequestType::kVersions:
      return read_versions(from, requested);
    case RequestType::kDescribe:
      return read_spans(from, requested);
  }
  return false;
}

void write_description_header(ByteWriter& to, const DescriptionHeader& header) noexcept {
  write_id(to, header.id);
  to.u32(header.target);
}

bool read_description_header(ByteReader& from, DescriptionHeader& header) noexcept {
  read_id(from, header.id);
  header.target = from.u32();
  return from.ok();
}

bool write_description(ByteWriter& to, const Description& description) noexcept {
  ByteWriter again = to;
  again.u8(description.span.width);
  again.u32(description.span.index);
  again.u8(static_cast<std::uint8_t>((description.is_list ? kIsList : 0) | description.part_width));
  again.u8(description.count);
  if (description.is_list) {
    again.u32(description.last);
    auto next = static_cast<std::uint32_t>(description.span.first());
    for (const Description::Mark& one : std::span(description.record).first(description.count)) {
      write_varint(again, one.version - next);
      next = one.version + 1;
    }
    for (const Description::Mark& one : std::span(description.record).first(description.count))
      again.u32(one.mark);
  } else {
    for (const std::uint64_t sum : std::span(description.sum).first(description.count))
      again.u64(sum);
  }
  if (!again.ok()) return false;
  to = again;
  return true;
}

namespace {

bool read_list(ByteReader& from, Description& description) noexcept {
  if (description.count > Description::kMostRecords || description.part_width != 0) return false;
  description.last = from.u32();
  const VersionSpan& span = description.span;
  if (description.last < span.first() || description.last > span.last()) return false;
  std::uint64_t next = span.first();
  const auto records = std::span(description.record).first(description.count);
  for (Description::Mark& one : records) {
    std::uint32_t step = 0;
    if (!read_varint(from, step) || next + step > description.last) return false;
    one.version = static_cast<std::uint32_t>(next + step);
    next = std::uint64_t{one.version} + 1;
  }
  for (Description::Mark& one : records) one.mark = from.u32();
  return from.ok();
}

}  // namespace

bool read_description(ByteReader& from, Description& description) noexcept {
  description.span.width = from.u8();
  description.span.index = from.u32();
  const std::uint8_t flags = from.u8();
  description.is_list = (flags & kIsList) != 0;
  description.part_width = flags & static_cast<std::uint8_t>(~kIsList);
  description.count = from.u8();
  if (!from.ok() || !is_span(description.span)) return false;
  if (description.is_list) return read_list(from, description);
  const unsigned parts = description.span.width - description.part_width;
  if (description.part_width >= description.span.width || parts > 6 ||
      description.count != 1U << parts)
    return false;
  for (std::uint64_t& sum : std::span(description.sum).first(description.count)) sum = from.u64();
  return from.ok();
}

}  // namespace tessera
