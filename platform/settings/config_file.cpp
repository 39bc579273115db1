// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "settings/config_file.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <numeric>

#include "base/number_text.hpp"

namespace tessera {

namespace {

/// Edit distance: letters to change, add or remove, or two neighbours to swap.
std::size_t distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before(b.size() + 1);
  std::vector<std::size_t> row(b.size() + 1);
  std::vector<std::size_t> next(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    next[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      next[j] =
          std::min({row[j] + 1, next[j - 1] + 1, row[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        next[j] = std::min(next[j], before[j - 2] + 1);
    }
    before.swap(row);
    row.swap(next);
  }
  return row[b.size()];
}

std::string nearest(std::string_view word, const std::vector<std::string>& names) {
  const auto best = std::min_element(names.begin(), names.end(), [&](const auto& a, const auto& b) {
    return distance(word, a) < distance(word, b);
  });
  return best == names.end() ? std::string() : *best;
}

std::vector<std::string> keys_of(const Json& object) {
  std::vector<std::string> names;
  for (const auto& item : object.items()) names.push_back(item.key());
  return names;
}

}  // namespace

std::size_t ConfigPlaces::line_of(std::string_view table, std::string_view key,
                                  std::size_t item) const {
  const auto found = std::find_if(lines_.begin(), lines_.end(), [&](const Line& line) {
    return line.table == table && line.key == key && line.item == item;
  });
  return found == lines_.end() ? 0 : found->line;
}

Failure ConfigPlaces::worded(const Failure& failure, std::size_t item) const {
  const SettingName* const about = failure.message.subject();
  if (about == nullptr || about->table.empty())
    return {failure.message.text(Speaker::kFile), failure.kind};
  std::string text = failure.message.text(Speaker::kFile);
  // The name is in front of it already.
  if (failure.message.begins_with_subject()) text.erase(0, about->key.size() + 1);
  std::size_t line = line_of(about->table, about->key, item);
  if (line == 0) line = line_of(about->table, "", item);
  const std::string where = line == 0 ? "" : fmt::format(", line {}", line);
  return {path_ + where + ": [" + std::string(about->table) + "] " + std::string(about->key) +
              ": " + text,
          failure.kind};
}

const ConfigFile::Entry* ConfigFile::find(const SettingName& setting) const {
  const auto found = std::find_if(entries_.begin(), entries_.end(), [&](const Entry& entry) {
    return entry.table == setting.table && entry.name == setting.key && entry.item == item_;
  });
  return found == entries_.end() ? nullptr : &*found;
}

void ConfigFile::refuse(const Failure& failure) {
  if (!failure_) failure_ = places_.worded(failure, item_);
}

std::size_t ConfigFile::count_items(std::string_view table) const {
  std::size_t items = 0;
  for (const Entry& entry : tables_)
    items = entry.table == table ? std::max(items, entry.item) : items;
  return items;
}

/// Known keys of a table, or of the first of an array of them.
const Json& ConfigFile::keys_in(const std::string& table) const {
  const Json& values = values_.at(table);
  return values.is_array() && !values.empty() ? values.front() : values;
}

/// A table that is an array in the file and is to be none, or the other way round.
std::optional<Failure> ConfigFile::misplaced(const Entry& table) const {
  const bool is_array = values_.at(table.table).is_array();
  if (is_array == (table.item != 0)) return std::nullopt;
  const std::string one = "[" + table.table + "]";
  const std::string many = "[" + one + "]";
  return Failure{fmt::format("{}, line {}: {} is written as {}", places_.path(), table.line,
                             is_array ? one : many, is_array ? many : one)};
}

Outcome<SettingValue> ConfigFile::value_of(const Setting& setting, const Entry& entry) const {
  const auto wrong = [&](const std::string& what) {
    return Failure{Message(setting.name) + " is " + what};
  };
  const auto* const text = std::get_if<std::string>(&entry.value);
  const auto* const whole = std::get_if<std::int64_t>(&entry.value);
  switch (setting.kind) {
    case SettingKind::kSwitch:
      if (const bool* const on = std::get_if<bool>(&entry.value)) return SettingValue(*on);
      if (text == nullptr || (*text != "on" && *text != "off"))
        return wrong("not true or false; write one of these without quotes");
      return SettingValue(*text == "on");
    case SettingKind::kReal:
      if (const double* const real = std::get_if<double>(&entry.value)) return SettingValue(*real);
      if (whole != nullptr) return SettingValue(static_cast<double>(*whole));
      if (text != nullptr && !text->empty() && *text == setting.allowed.zero)
        return SettingValue(0.0);
      return setting.allowed.zero.empty() || setting.allowed.zero == "0"
                 ? wrong("not a number; write one without quotes")
                 : wrong("neither a number nor \"" + std::string(setting.allowed.zero) + "\"");
    case SettingKind::kWhole:
      // A negative one would be taken for the bits of a large one.
      if (whole != nullptr && !(setting.member.wide && *whole < 0)) return SettingValue(*whole);
      if (whole != nullptr)
        return not_allowed(setting.name, std::to_string(*whole), allowed_text(setting));
      return Failure{Message(setting.name) + " is not a whole number; give " +
                     allowed_text(setting)};
    case SettingKind::kBytes: {
      if (whole != nullptr && *whole >= 0) return SettingValue(*whole);
      const std::optional<std::size_t> bytes = parse_bytes(text != nullptr ? *text : "");
      if (bytes) return SettingValue(static_cast<std::int64_t>(*bytes));
      return wrong("not a number of bytes; give a whole number, or \"64M\"");
    }
    case SettingKind::kNumbers: {
      const auto* const given = std::get_if<std::vector<std::int64_t>>(&entry.value);
      constexpr std::int64_t kMost = std::numeric_limits<std::uint32_t>::max();
      const auto is_good = [](std::int64_t one) { return one >= 0 && one <= kMost; };
      if (given == nullptr || !std::all_of(given->begin(), given->end(), is_good))
        return wrong("not a list of whole numbers; write [1, 2]");
      return SettingValue(std::vector<std::uint32_t>(given->begin(), given->end()));
    }
    case SettingKind::kReals: {
      if (const auto* const reals = std::get_if<std::vector<double>>(&entry.value))
        return SettingValue(*reals);
      const auto* const wholes = std::get_if<std::vector<std::int64_t>>(&entry.value);
      if (wholes == nullptr) return wrong("not a list of numbers; write [0.5, 1]");
      return SettingValue(std::vector<double>(wholes->begin(), wholes->end()));
    }
    case SettingKind::kChoice:
    case SettingKind::kText:
    case SettingKind::kPath:
      break;
  }
  if (text == nullptr) return wrong("not text; write it in quotes");
  if (setting.kind != SettingKind::kPath || text->empty()) return SettingValue(*text);
  return SettingValue((std::filesystem::path(places_.path()).parent_path() / *text).string());
}

void ConfigFile::read(const Setting& setting, void* options) {
  if (setting.name.key.empty()) return;
  if (const Entry* const entry = find(setting.name)) {
    const Outcome<SettingValue> value = value_of(setting, *entry);
    const Outcome<void> done =
        value.ok() ? assign(setting, options, *value) : Outcome<void>(value.failure());
    if (!done.ok()) refuse(done.failure());
  } else if (!setting.required.empty()) {
    refuse({Message(setting.name) + " is missing; give " + std::string(setting.required)});
  }
  const SettingValue held = setting.member.get(options);
  const bool* const on = std::get_if<bool>(&held);
  Json& values = values_[std::string(setting.name.table)];
  Json& table = item_ == 0 ? values : values[item_ - 1];
  table[std::string(setting.name.key)] = on != nullptr ? Json(*on) : json_of(setting, options);
}

Failure ConfigFile::unknown(const Entry& entry) const {
  const std::string where = fmt::format("{}, line {}: ", places_.path(), entry.line);
  const bool is_table = values_.contains(entry.table);
  // The key may be right and the table wrong.
  for (const auto& table : values_.items()) {
    if (table.key() != entry.table && keys_in(table.key()).contains(entry.name)) {
      return {where + "unknown key " + entry.name + " in [" + entry.table + "]; it is in [" +
              table.key() + "]"};
    }
  }
  if (!is_table) {
    return {where + "unknown table [" + entry.table + "]; did you mean [" +
            nearest(entry.table, keys_of(values_)) + "]?"};
  }
  return {where + "unknown key " + entry.name + " in [" + entry.table + "]; did you mean " +
          nearest(entry.name, keys_of(keys_in(entry.table))) + "?"};
}

Outcome<void> ConfigFile::finish() const {
  for (const Entry& table : tables_) {
    if (!values_.contains(table.table)) return unknown(table);
    if (std::optional<Failure> failure = misplaced(table)) return *failure;
  }
  // First of all: an unknown key explains the one that is missing because of it.
  for (const Entry& entry : entries_) {
    if (!keys_in(entry.table).contains(entry.name)) return unknown(entry);
  }
  if (failure_) return *failure_;
  return {};
}

}  // namespace tessera
