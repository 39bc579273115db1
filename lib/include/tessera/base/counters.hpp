// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A number of a report is written once, as a row of a list: kind, type, name, sentence. The members
// of the struct, its table, JSON, Python, C, sums and pages come from it. Kinds:
//   COUNTER   counts; adds up over reports.
//   LEVEL     how something stands, a limit or a worst case; the highest of several reports counts.
//   FIGURE    the same as a number that is not whole: a double.
//   TOTAL     a function of the report that is written by hand; adds up.
//   RESERVED  room in the struct for C; nothing elsewhere.
#pragma once

#include <array>
#include <cstdint>

namespace tessera {

// The lists are for C too, and have its names.
using std::int64_t;
using std::uint32_t;
using std::uint64_t;

/// A row of a report's table.
template <class Report>
struct Counter {
  const char* name = "";
  const char* sentence = "";
  /// Null for a figure.
  std::int64_t (*value)(const Report& report) = nullptr;
  double (*figure)(const Report& report) = nullptr;  ///< Given for a figure alone.
};

/// Calls use(number) with what the report has there, a std::int64_t or a double.
template <class Report, class Use>
constexpr void with_number(const Counter<Report>& row, const Report& report, Use&& use) {
  row.figure != nullptr ? use(row.figure(report)) : use(row.value(report));
}

/// The table of a report. Specialised where the report is declared, by TESSERA_COUNTER_TABLE.
template <class Report>
inline constexpr std::array<Counter<Report>, 0> kCounters{};

/// The highest level is kept.
template <class Level>
constexpr void keep_highest(Level& highest, const Level& level) noexcept {
  if (highest < level) highest = level;
}

}  // namespace tessera

#define TESSERA_COUNTER_MEMBER(kind, type, name, sentence) TESSERA_MEMBER_OF_##kind(type, name)
#define TESSERA_MEMBER_OF_COUNTER(type, name) type name = 0;
#define TESSERA_MEMBER_OF_LEVEL(type, name) type name = 0;
#define TESSERA_MEMBER_OF_FIGURE(type, name) type name = 0;
#define TESSERA_MEMBER_OF_TOTAL(type, name)
#define TESSERA_MEMBER_OF_RESERVED(type, name)

/// After a report, in its namespace; ROWS: its lists, each given TESSERA_COUNTER_ROW.
#define TESSERA_COUNTER_TABLE(Report, ...) \
  template <>                              \
  inline constexpr auto kCounters<Report> = std::to_array<Counter<Report>>({__VA_ARGS__});
#define TESSERA_COUNTER_ROW(kind, type, name, sentence) TESSERA_ROW_OF_##kind(name, sentence)
#define TESSERA_ROW_OF_COUNTER(name, sentence) TESSERA_ROW_BY(name, sentence, name)
#define TESSERA_ROW_OF_LEVEL(name, sentence) TESSERA_ROW_BY(name, sentence, name)
#define TESSERA_ROW_OF_FIGURE(name, sentence) \
  {#name, sentence, nullptr, [](const auto& report) { return static_cast<double>(report.name); }},
#define TESSERA_ROW_OF_TOTAL(name, sentence) TESSERA_ROW_BY(name, sentence, name())
#define TESSERA_ROW_OF_RESERVED(name, sentence)
#define TESSERA_ROW_BY(name, sentence, value) \
  {#name, sentence, [](const auto& report) { return static_cast<std::int64_t>(report.value); }},

/// Declares a struct of sums over reports of a list, and its table. Of a level it has the highest.
#define TESSERA_COUNTER_SUMS(Sums, Report, LIST)                            \
  struct Sums {                                                             \
    LIST(TESSERA_SUM_MEMBER)                                                \
    void add(const Report& report) noexcept { LIST(TESSERA_SUM_STATEMENT) } \
  };                                                                        \
  TESSERA_COUNTER_TABLE(Sums, LIST(TESSERA_SUM_ROW))
#define TESSERA_SUM_MEMBER(kind, type, name, sentence) TESSERA_SUM_OF_##kind(type, name)
#define TESSERA_SUM_OF_COUNTER(type, name) std::uint64_t name = 0;
#define TESSERA_SUM_OF_LEVEL(type, name) type name = 0;
#define TESSERA_SUM_OF_FIGURE(type, name) type name = 0;
#define TESSERA_SUM_OF_TOTAL(type, name) std::uint64_t name = 0;
#define TESSERA_SUM_OF_RESERVED(type, name)
#define TESSERA_SUM_STATEMENT(kind, type, name, sentence) TESSERA_SUM_BY_##kind(name)
#define TESSERA_SUM_BY_COUNTER(name) name += report.name;
#define TESSERA_SUM_BY_LEVEL(name) keep_highest(name, report.name);
#define TESSERA_SUM_BY_FIGURE(name) keep_highest(name, report.name);
#define TESSERA_SUM_BY_TOTAL(name) name += report.name();
#define TESSERA_SUM_BY_RESERVED(name)
#define TESSERA_SUM_ROW(kind, type, name, sentence) TESSERA_SUM_ROW_OF_##kind(name, sentence)
#define TESSERA_SUM_ROW_OF_COUNTER(name, sentence) TESSERA_ROW_BY(name, sentence, name)
#define TESSERA_SUM_ROW_OF_LEVEL(name, sentence) TESSERA_ROW_BY(name, sentence, name)
#define TESSERA_SUM_ROW_OF_FIGURE(name, sentence) TESSERA_ROW_OF_FIGURE(name, sentence)
#define TESSERA_SUM_ROW_OF_TOTAL(name, sentence) TESSERA_ROW_BY(name, sentence, name)
#define TESSERA_SUM_ROW_OF_RESERVED(name, sentence)
