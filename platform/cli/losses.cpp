// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/losses.hpp"

#include <algorithm>
#include <span>

#include "base/number_text.hpp"

namespace tessera {

void NumberList::add(int number) {
  if (count_ < kShown) first_[count_] = number;
  ++count_;
}

std::string NumberList::text() const {
  std::string text;
  for (std::size_t i = 0; i < std::min(count_, kShown); ++i)
    text += (i == 0 ? "" : ", ") + std::to_string(first_[i]);
  return count_ > kShown ? text + ", ..." : text;
}

void UnknownIdCount::add(int scan, const UnknownRawIds& ids) {
  if (ids.points == 0) return;
  if (all_.points == 0) first_scan_ = scan;
  const std::uint64_t points = all_.points + ids.points;
  for (const std::uint16_t id : std::span(ids.examples).first(ids.num_examples)) all_.add(id);
  all_.points = points;
}

std::string UnknownIdCount::text() const {
  std::string ids;
  for (const std::uint16_t id : std::span(all_.examples).first(all_.num_examples))
    ids += (ids.empty() ? "" : ", ") + std::to_string(id);
  // A complete list of the greatest length cannot be distinguished from a cut one.
  if (all_.num_examples == UnknownRawIds::kMaxExamples) ids += ", ...";
  return counted(all_.points, "point") + (folder_.empty() ? "" : " of " + folder_) +
         " with class ids that are in no class (" + ids + "), first in scan " +
         std::to_string(first_scan_) + "; taken as unlabelled";
}

}  // namespace tessera
