// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Reports as JSON, from the tables of their numbers.
#pragma once

#include <string>
#include <string_view>

#include "base/json.hpp"
#include "tessera/base/counters.hpp"

namespace tessera {

/// Adds all numbers of a report by their names. Times, `..._us`, are written in milliseconds, as
/// `..._ms`.
template <class Report>
void add_counters(Json& json, const Report& report) {
  constexpr std::string_view kMicroseconds = "_us";
  for (const Counter<Report>& row : kCounters<Report>) {
    std::string name(row.name);
    const bool is_time = name.ends_with(kMicroseconds);
    if (is_time) name.replace(name.size() - 2, 2, "ms");
    with_number(row, report, [&](auto number) {
      if (is_time)
        json[name] = 1e-3 * static_cast<double>(number);
      else
        json[name] = number;
    });
  }
}

template <class Report>
[[nodiscard]] Json counters_json(const Report& report) {
  Json json;
  add_counters(json, report);
  return json;
}

}  // namespace tessera
