// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "scans/scan_losses.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <span>

#include "base/number_text.hpp"
#include "settings/map_options.hpp"

namespace tessera {

std::uint64_t left_out_for_memory(const ScanTotals& totals) noexcept {
  return totals.over_capacity + totals.refused_memory + totals.rays_refused_memory;
}

std::uint64_t left_out_for_work(const ScanTotals& totals) noexcept {
  return totals.refused_work + totals.rays_refused_work;
}

namespace {

/// With less than one of a hundred in range, next to nothing was mapped.
constexpr std::uint64_t kHundred = 100;

struct Reason {
  NothingMapped why;
  std::uint64_t points = 0;
};

/// That of most points which are not in range.
Reason main_reason(const ScanTotals& t, std::uint64_t of_bad_poses) noexcept {
  const std::array<Reason, 7> reasons{{{NothingMapped::kBeyondRange, t.beyond_range},
                                       {NothingMapped::kTooNear, t.too_near},
                                       {NothingMapped::kOnBody, t.on_body},
                                       {NothingMapped::kNoReturn, t.no_return},
                                       {NothingMapped::kBadPose, of_bad_poses},
                                       {NothingMapped::kNotFinite, t.non_finite},
                                       {NothingMapped::kOutOfGrid, t.out_of_grid}}};
  return *std::max_element(reasons.begin(), reasons.end(),
                           [](const Reason& a, const Reason& b) { return a.points < b.points; });
}

Message text_of(NothingMapped why) {
  switch (why) {
    case NothingMapped::kBeyondRange:
      return "beyond " + Message(kMapSettings["--max-range"]) +
             "; give a larger one, or points in metres";
    case NothingMapped::kTooNear:
      return "nearer to the sensor than " + Message(kMapSettings["--min-range"]) +
             "; give a smaller one, or points in metres";
    case NothingMapped::kOnBody:
      return "on the robot's own body; check " + Message(kMapSettings["--body"]);
    case NothingMapped::kNoReturn:
      return "of directions from which nothing came back; check the input";
    case NothingMapped::kBadPose:
      return "of scans whose pose is refused; check the poses";
    case NothingMapped::kNotFinite:
      return "without finite coordinates; check the input";
    default:
      return "outside the grid; check the input";
  }
}

}  // namespace

std::optional<NothingMapped> why_nothing_mapped(const ScanTotals& totals,
                                                std::uint64_t of_bad_poses) noexcept {
  if (totals.points == 0) return NothingMapped::kNoPoints;
  const Reason main = main_reason(totals, of_bad_poses);
  const bool few_in_range = totals.in_range * kHundred < totals.points;
  if (few_in_range && main.points > totals.over_capacity) return main.why;
  if (totals.points_kept > 0) return std::nullopt;
  return NothingMapped::kLeftOut;
}

Message text_of(NothingMapped why, const ScanTotals& totals, std::uint64_t of_bad_poses) {
  if (why == NothingMapped::kNoPoints) {
    return "nothing was mapped: " + Message("the scans have", "the scan has") +
           " no points; check the input";
  }
  const std::string all = counted(totals.points, "point");
  if (why == NothingMapped::kLeftOut) {
    return fmt::format("no point was mapped: of {} {} are beyond ", all, totals.beyond_range) +
           Message(kMapSettings["--max-range"]) +
           fmt::format(" and {} within it; the report says why each was left out", totals.in_range);
  }
  const std::uint64_t points = main_reason(totals, of_bad_poses).points;
  return fmt::format("{} point was mapped: {}{} are ", totals.points_kept == 0 ? "no" : "almost no",
                     points == totals.points ? "all " : fmt::format("{} of ", points), all) +
         text_of(why);
}

std::string text_of(const UnknownRawIds& ids, const std::string& folder) {
  std::string examples;
  for (const std::uint16_t id : std::span(ids.examples).first(ids.num_examples))
    examples += fmt::format("{}{}", (examples.empty() ? "" : ", "), id);
  // A complete list of the greatest length cannot be distinguished from a cut one.
  if (ids.num_examples == UnknownRawIds::kMaxExamples) examples += ", ...";
  return fmt::format("{}{} with class ids that are in no class ({})", counted(ids.points, "point"),
                     (folder.empty() ? "" : " of " + folder), examples);
}

}  // namespace tessera
