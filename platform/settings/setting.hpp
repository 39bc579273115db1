// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// One setting: a row with its names, its member, what is allowed, and its sentence. The command
// line, configuration files, Python, help, manual pages and the reference read these rows.
#pragma once

#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

#include "base/json.hpp"
#include "base/message.hpp"
#include "base/outcome.hpp"
#include "settings/setting_member.hpp"

namespace tessera {

/// The numbers that are allowed.
struct Allowed {
  double least = -std::numeric_limits<double>::max();
  double most = std::numeric_limits<double>::max();
  bool above = false;        ///< least itself is not allowed.
  bool below = false;        ///< most itself is not allowed.
  std::string_view what{};   ///< Of what: "metres"; empty: "a number", "a whole number".
  std::string_view zero{};   ///< The word for 0, which is then allowed too: "off".
  std::string_view words{};  ///< Instead of all this in messages.
};
constexpr Allowed from_to(double least, double most, std::string_view what = {}) {
  return {.least = least, .most = most, .what = what};
}
/// Without least itself.
constexpr Allowed above(double least, double most, std::string_view what = {}) {
  return {.least = least, .most = most, .above = true, .what = what};
}
constexpr Allowed between(double least, double most) {
  return {.least = least, .most = most, .above = true, .below = true};
}

/// What a row may have besides its name, member and sentence.
struct SettingDetails {
  std::string_view value{};      ///< The name of its value in help: "M"; empty: its choices.
  std::string_view otherwise{};  ///< What holds if it is not given, where that depends on others.
  Allowed allowed{};
  std::span<const std::string_view> choices{};  ///< Of text.
  std::string_view required{};  ///< It must be given; what to give in a configuration file.
  bool fixed = false;           ///< For the life of a map.
  bool flag = false;            ///< Of the command line: without a value.
};

struct Setting : SettingDetails {
  SettingName name{};
  SettingMember member{};
  std::string_view sentence{};  ///< Without a full stop.
  SettingKind kind{};

  [[nodiscard]] constexpr std::span<const std::string_view> words() const {
    return choices.empty() ? member.choices : choices;
  }
};

/// A row for a member, or a member of a member.
template <auto... kMembers>
constexpr Setting row(const SettingName& name, std::string_view sentence,
                      const SettingDetails& details = {}) {
  const SettingMember at = member<kMembers...>();
  return {details, name, at, sentence, details.choices.empty() ? at.kind : SettingKind::kChoice};
}
template <auto... kMembers>
constexpr Setting path_row(const SettingName& name, std::string_view sentence,
                           const SettingDetails& details = {}) {
  return {details, name, member<kMembers...>(), sentence, SettingKind::kPath};
}
template <auto... kMembers>
constexpr Setting bytes_row(const SettingName& name, std::string_view sentence,
                            const SettingDetails& details = {}) {
  return {details, name, member<kMembers...>(), sentence, SettingKind::kBytes};
}

/// The rows for an object of options.
template <class Options>
struct SettingTable {
  /// Does not compile with a row for another object.
  consteval explicit SettingTable(std::span<const Setting> all) : rows(all) {
    for (const Setting& row : all) {
      if (row.member.owner != &detail::kTagOf<Options>) throw "a row is of other options";
    }
  }
  /// By its option, or by "table.key"; does not compile if there is none.
  [[nodiscard]] consteval const SettingName& operator[](std::string_view name) const {
    for (const Setting& row : rows) {
      const std::string_view key = row.name.key;
      const bool is_key = !key.empty() && name.ends_with(key) && name.starts_with(row.name.table) &&
                          name.size() == row.name.table.size() + 1 + key.size();
      if (row.name.option == name || is_key) return row.name;
    }
    throw "there is no such setting";
  }

  std::span<const Setting> rows;
};

/// "SETTING given is not allowed; give allowed".
Failure not_allowed(const SettingName& setting, const std::string& given, const Message& allowed);
/// What is allowed, in words: "metres from 0.001 to 100", "on or off".
[[nodiscard]] Message allowed_text(const Setting& setting);
/// The limits of its row without those of its type, for help: "metres from 0.001 to 100"; empty: it
/// has none, or is not a number.
[[nodiscard]] Message stated_range(const Setting& setting);

/// Fails with kUsage iff the value is not allowed, or is not of the setting's kind; the options are
/// unchanged then.
Outcome<void> assign(const Setting& setting, void* options, const SettingValue& value);
/// A value that is given as text: "0.5", "on", "64M". Fails as assign.
Outcome<SettingValue> parse_value(const Setting& setting, const std::string& text);

/// As a user types it; empty: not given.
[[nodiscard]] std::string text_of(const Setting& setting, const SettingValue& value);
/// For reports, a switch as "on" or "off"; null: not given.
[[nodiscard]] Json json_of(const Setting& setting, const void* options);
namespace detail {
Json json_of(std::span<const Setting> rows, const void* options);
}
/// All of a table, by the names of options without dashes: "max_range".
template <class Options>
[[nodiscard]] Json json_of(const SettingTable<Options>& table,
                           const std::type_identity_t<Options>& options) {
  return detail::json_of(table.rows, &options);
}

}  // namespace tessera
