// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "scans/point_fields.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <system_error>

namespace tessera {
namespace {

/// Field names of each part; the first that exists is used.
constexpr std::array<std::array<std::string_view, 3>, kNumParts> kNames{
    {{"x"}, {"y"}, {"z"}, {"intensity"}, {"no_return"}, {"label", "class", "semantic"}}};

bool parse_label(std::string_view word, std::int64_t& raw_id) {
  const char* const end = word.data() + word.size();
  const auto [stopped, error] = std::from_chars(word.data(), end, raw_id);
  if (error == std::errc{} && stopped == end) return true;
  double value = 0.0;
  return parse_double(word, value) && as_whole(value, raw_id);
}

bool is_plausible(double coordinate_m) {
  const double size_m = std::abs(coordinate_m);
  return size_m >= 1e-6 && size_m <= 1e6;
}

}  // namespace

Outcome<PointFields> PointFields::choose(const CloudBytes& head,
                                         const std::vector<std::string>& names) {
  PointFields fields;
  const std::size_t end = head.with_labels ? kNumParts : kPartLabel;
  for (std::size_t part = 0; part < end; ++part) {
    for (const std::string_view name : kNames[part]) {
      if (name.empty()) continue;  // Also the name of a list, which is not read.
      const auto found = std::find(names.begin(), names.end(), name);
      if (found == names.end()) continue;
      if (std::find(found + 1, names.end(), name) != names.end()) {
        return cloud_failure(head.path, "duplicate field " + std::string(name),
                             "give each field its own name");
      }
      fields.index_[part] = static_cast<std::size_t>(found - names.begin());
      break;
    }
    if (part <= kPartZ && fields.index_[part] == kAbsent) {
      return cloud_failure(head.path, "no field " + std::string(kNames[part][0]),
                           "a cloud needs the fields x, y and z");
    }
  }
  return fields;
}

std::size_t PointFields::part_of(std::size_t field) const noexcept {
  return static_cast<std::size_t>(std::find(index_.begin(), index_.end(), field) - index_.begin());
}

PointAppender::PointAppender(Cloud& cloud, const CloudSummary& summary, bool leaves_out_no_returns)
    : cloud_(cloud),
      has_labels_(summary.has_labels),
      keeps_no_returns_(summary.keeps_no_returns),
      leaves_out_no_returns_(leaves_out_no_returns) {
  cloud_.points_xyzi.clear();
  cloud_.raw_ids.clear();
  cloud_.no_return.clear();
  cloud_.points_xyzi.reserve(summary.points * kFloatsPerPoint);
  if (has_labels_) cloud_.raw_ids.reserve(summary.points);
  if (keeps_no_returns_) cloud_.no_return.reserve(summary.points);
}

void PointAppender::append(const std::array<double, kNumParts>& parts, std::int64_t raw_id) {
  for (std::size_t part = 0; part < kFloatsPerPoint; ++part)
    cloud_.points_xyzi.push_back(static_cast<float>(parts[part]));
  if (has_labels_) cloud_.raw_ids.push_back(raw_id);
  if (keeps_no_returns_) cloud_.no_return.push_back(parts[kPartNoReturn] != 0.0 ? 1 : 0);
}

bool PointAppender::is_left_out(const std::array<double, kNumParts>& parts) const noexcept {
  if (!keeps_no_returns_ && parts[kPartNoReturn] != 0.0) return true;
  return leaves_out_no_returns_ && std::isnan(parts[kPartX]) && std::isnan(parts[kPartY]) &&
         std::isnan(parts[kPartZ]);
}

bool PointAppender::append(const Places& places) {
  std::array<double, kNumParts> parts{};
  for (std::size_t part = 0; part < kPartLabel; ++part) {
    const Place& place = places[part];
    if (place.from == nullptr) continue;
    parts[part] = place.number.load(place.from);
    if (part <= kPartZ) byte_order_.add(place.number, place.from);
  }
  if (is_left_out(parts)) return true;
  std::int64_t raw_id = 0;
  const Place& label = places[kPartLabel];
  if (label.from != nullptr && !label.number.load_whole(label.from, raw_id)) return false;
  append(parts, raw_id);
  return true;
}

Outcome<void> PointAppender::append(const Words& words, const TextPlace& place) {
  std::array<double, kNumParts> parts{};
  for (std::size_t part = 0; part < kPartLabel; ++part) {
    if (!words[part].empty() && !parse_double(words[part], parts[part]))
      return not_a_number(place, printable(words[part]),
                          "write the numbers of each point in one row");
  }
  if (is_left_out(parts)) return {};
  std::int64_t raw_id = 0;
  if (has_labels_ && !parse_label(words[kPartLabel], raw_id)) {
    return text_failure(place, "the label is not a whole number",
                        "write the class ids as integers");
  }
  append(parts, raw_id);
  return {};
}

Failure bad_label(std::string_view path, std::size_t point) {
  return cloud_failure(path,
                       fmt::format("the label of point {} (from 0) is not a whole number", point),
                       "write the class ids as integers");
}

void ByteOrderVote::add(const StoredNumber& number, const char* from) noexcept {
  // Enough to decide, and a small part of a scan's time.
  constexpr std::size_t kMost = 4096;
  if (number.kind != NumberKind::kFloat || looked_at_ >= kMost) return;
  const StoredNumber other{number.kind, number.bytes, !number.is_big_endian};
  const double stored = number.load(from);
  const double reversed = other.load(from);
  if (!(std::abs(stored) > 0.0) || std::isnan(reversed)) return;
  ++looked_at_;
  plausible_ += is_plausible(stored) ? 1U : 0U;
  plausible_reversed_ += is_plausible(reversed) ? 1U : 0U;
}

Outcome<void> ByteOrderVote::check(std::string_view path) const {
  // A few numbers may be implausible by chance.
  constexpr std::size_t kFewest = 12;
  // By chance a sixth of the numbers make sense with their bytes reversed.
  if (looked_at_ < kFewest || 2 * plausible_ >= looked_at_ ||
      10 * plausible_reversed_ < 9 * looked_at_)
    return {};
  return cloud_failure(path, "its coordinates make sense only in the other byte order",
                       "write it again in the byte order that its format says");
}

}  // namespace tessera
