// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Finds the fields of position, intensity and label in a cloud, and makes points of them.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "base/number_row.hpp"
#include "base/outcome.hpp"
#include "scans/cloud.hpp"
#include "scans/stored_number.hpp"

namespace tessera {

/// The parts of a point that are read. A label is a raw class id.
enum PointPart : std::size_t {
  kPartX,
  kPartY,
  kPartZ,
  kPartIntensity,
  kPartNoReturn,
  kPartLabel,
  kNumParts
};

/// For each part the index of its field.
class PointFields {
 public:
  static constexpr std::size_t kAbsent = static_cast<std::size_t>(-1);

  /// Chooses by name: x, y, z; intensity; no_return; with labels label, or else class, or else
  /// semantic. Fails with kUsage iff x, y or z is missing, or one that is used is a duplicate.
  static Outcome<PointFields> choose(const CloudBytes& head, const std::vector<std::string>& names);

  [[nodiscard]] bool has(PointPart part) const noexcept { return index_[part] != kAbsent; }
  [[nodiscard]] std::size_t index(std::size_t part) const noexcept { return index_[part]; }
  /// The part that the field is, or kNumParts.
  [[nodiscard]] std::size_t part_of(std::size_t field) const noexcept;

 private:
  std::array<std::size_t, kNumParts> index_{kAbsent, kAbsent, kAbsent, kAbsent, kAbsent, kAbsent};
};

/// Checks that coordinates are stored in the byte order that their file says.
class ByteOrderVote {
 public:
  /// Adds a coordinate; ignores integers, and everything after some thousands.
  void add(const StoredNumber& number, const char* from) noexcept;
  /// Fails with kUsage iff the coordinates make sense in the other byte order only: of 12 or more
  /// that are neither 0 nor NaN less than half are from 1e-6 to 1e6, but nine of ten are with their
  /// bytes reversed.
  Outcome<void> check(std::string_view path) const;

 private:
  std::size_t looked_at_ = 0;
  std::size_t plausible_ = 0;
  std::size_t plausible_reversed_ = 0;
};

/// Appends points to a cloud that has been emptied.
class PointAppender {
 public:
  struct Place {
    StoredNumber number;
    const char* from = nullptr;  ///< Null: the point does not have this part.
  };
  using Places = std::array<Place, kNumParts>;
  using Words =
      std::array<std::string_view, kNumParts>;  ///< Empty: the point does not have this part.

  /// leaves_out_no_returns: leaves out points whose x, y and z are all NaN, which organised clouds
  /// have without a return. Reserves memory for the points, which the file must be able to hold.
  PointAppender(Cloud& cloud, const CloudSummary& summary, bool leaves_out_no_returns);

  /// False iff the label is not a whole number.
  [[nodiscard]] bool append(const Places& places);
  /// Fails with kUsage iff a word is not a number, or the label not a whole one.
  Outcome<void> append(const Words& words, const TextPlace& place);
  /// Checks the places so far. Fails as ByteOrderVote::check().
  Outcome<void> check_byte_order(std::string_view path) const { return byte_order_.check(path); }

 private:
  /// Of a point that is no return and is not to be kept.
  [[nodiscard]] bool is_left_out(const std::array<double, kNumParts>& parts) const noexcept;
  void append(const std::array<double, kNumParts>& parts, std::int64_t raw_id);

  Cloud& cloud_;
  bool has_labels_;
  bool keeps_no_returns_;
  bool leaves_out_no_returns_;
  ByteOrderVote byte_order_;
};

/// The failure of a label that is not a whole number; point counts from 0.
[[nodiscard]] Failure bad_label(std::string_view path, std::size_t point);

}  // namespace tessera
