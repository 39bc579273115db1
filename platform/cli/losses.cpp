// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/losses.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <span>

#include "base/number_text.hpp"
#include "scans/scan_losses.hpp"

namespace tessera {

void NumberList::add(int number) {
  if (count_ < kShown) first_[count_] = number;
  ++count_;
}

std::string NumberList::text() const {
  std::string text;
  for (std::size_t i = 0; i < std::min(count_, kShown); ++i)
    text += fmt::format("{}{}", (i == 0 ? "" : ", "), first_[i]);
  return count_ > kShown ? text + ", ..." : text;
}

std::string text_of_bad_poses(const NumberList& scans) {
  return counted(scans.count(), "scan") +
         " left out, with a pose that is not a rigid transform: " + scans.text();
}

void UnknownIdCount::add(int scan, const UnknownRawIds& ids) {
  if (ids.points == 0) return;
  if (all_.points == 0) first_scan_ = scan;
  const std::uint64_t points = all_.points + ids.points;
  for (const std::uint16_t id : std::span(ids.examples).first(ids.num_examples)) all_.add(id);
  all_.points = points;
}

std::string UnknownIdCount::text() const {
  return text_of(all_, folder_) +
         fmt::format(", first in scan {}; taken as unlabelled", first_scan_);
}

}  // namespace tessera
