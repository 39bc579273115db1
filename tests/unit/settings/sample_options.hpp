// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Options of every kind, with a table.
#pragma once

#include "settings/setting.hpp"

namespace tessera {

enum class Side { kLeft, kRight };
constexpr const char* to_string(Side side) { return side == Side::kLeft ? "left" : "right"; }
template <>
inline constexpr std::array kChoicesOf<Side>{Side::kLeft, Side::kRight};

struct SampleOptions {
  bool on = false;
  double real_m = 1.5;
  std::optional<double> cell_m;
  std::uint32_t whole = 1;
  std::optional<int> maybe;
  std::size_t bytes = 1024;
  Side side = Side::kLeft;
  std::string way = "near";
  std::string text;
  std::string path;
  std::vector<std::uint32_t> list;
  std::vector<double> reals;
  struct Inner {
    std::uint64_t deep = 7;
  } inner;
};

inline constexpr std::array<std::string_view, 2> kWays{"near", "far"};
inline constexpr Setting kSampleRows[] = {
    row<&SampleOptions::on>({"--on", "a", "on"}, ""),
    row<&SampleOptions::real_m>({"--real", "a", "real_m"}, "",
                                {.allowed = from_to(0.0, 9.0, "metres")}),
    row<&SampleOptions::cell_m>(
        {"--cell", "a", "cell_m"}, "",
        {.otherwise = "as real",
         .allowed = {.least = 0.5, .most = 2.0, .what = "metres", .zero = "off"}}),
    row<&SampleOptions::whole>({"--whole", "a", "whole"}, "", {.allowed = from_to(2.0, 9.0)}),
    row<&SampleOptions::maybe>({"--maybe", "b", "maybe"}, ""),
    bytes_row<&SampleOptions::bytes>({"--bytes", "b", "bytes", "size_bytes"}, "",
                                     {.allowed = {.most = 1e15}}),
    row<&SampleOptions::side>({"--side", "b", "side"}, ""),
    row<&SampleOptions::way>({"--way", "b", "way"}, "", {.choices = kWays}),
    row<&SampleOptions::text>({"--text", "b", "text"}, ""),
    path_row<&SampleOptions::path>({"--path", "b", "path"}, ""),
    row<&SampleOptions::list>({.table = "b", .key = "list"}, ""),
    row<&SampleOptions::reals>({"--reals", "b", "reals"}, ""),
    row<&SampleOptions::inner, &SampleOptions::Inner::deep>({"--deep", "b", "deep"}, ""),
};
inline constexpr SettingTable<SampleOptions> kSample{kSampleRows};

inline const Setting& sample_row(std::string_view option) {
  for (const Setting& row : kSampleRows) {
    if (row.name.option == option) return row;
  }
  return kSampleRows[0];
}

}  // namespace tessera
