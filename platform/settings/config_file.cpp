// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "settings/config_file.hpp"

#include <algorithm>
#include <filesystem>
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

std::string range_text(double least, double most) {
  if (most >= std::numeric_limits<double>::max()) return "from " + text_of(least);
  return "from " + text_of(least) + " to " + text_of(most);
}

}  // namespace

const ConfigFile::Entry* ConfigFile::find(ConfigKey key) const {
  const auto found = std::find_if(entries_.begin(), entries_.end(), [&](const Entry& entry) {
    return entry.table == key.table && entry.name == key.name;
  });
  return found == entries_.end() ? nullptr : &*found;
}

void ConfigFile::note(ConfigKey key, Json value) {
  values_[key.table][key.name] = std::move(value);
}

Failure ConfigFile::refusal(ConfigKey key, const std::string& what) const {
  std::size_t line = 0;
  for (const Table& table : tables_) {
    if (table.name == key.table) line = table.line;
  }
  if (const Entry* const entry = find(key)) line = entry->line;
  const std::string where = line == 0 ? "" : ", line " + std::to_string(line);
  return {path_ + where + ": [" + key.table + "] " + key.name + ": " + what};
}

void ConfigFile::refuse(ConfigKey key, const std::string& what) {
  if (!failure_) failure_ = refusal(key, what);
  note(key, Json());  // So that the key counts as known.
}

void ConfigFile::take(ConfigKey key, bool& value) {
  if (const Entry* const entry = find(key)) {
    const bool* const given = std::get_if<bool>(&entry->value);
    if (given == nullptr) refuse(key, "is not true or false; write one of these without quotes");
    value = given != nullptr && *given;
  }
  note(key, value);
}

void ConfigFile::take_real(ConfigKey key, double& value, Real range) {
  const Entry* const entry = find(key);
  if (entry == nullptr) return;
  if (const double* const real = std::get_if<double>(&entry->value)) {
    value = *real;
  } else if (const std::int64_t* const whole = std::get_if<std::int64_t>(&entry->value)) {
    value = static_cast<double>(*whole);
  } else {
    return refuse(key, "is not a number; write one without quotes");
  }
  if (!(value >= range.least && value <= range.most)) {
    refuse(key, text_of(value) + " is not allowed; give a number " +
                    range_text(range.least, range.most));
  }
}

void ConfigFile::take(ConfigKey key, double& value, Real range) {
  take_real(key, value, range);
  note(key, value);
}

void ConfigFile::take(ConfigKey key, std::optional<double>& value, Real range) {
  if (is_given(key)) take_real(key, value.emplace(), range);
  note(key, value ? Json(*value) : Json());
}

void ConfigFile::take_whole(ConfigKey key, std::int64_t& value, Whole range) {
  if (const Entry* const entry = find(key)) {
    const std::int64_t* const given = std::get_if<std::int64_t>(&entry->value);
    const bool open = range.most == std::numeric_limits<std::int64_t>::max();
    const std::string allowed = "a whole number from " + std::to_string(range.least) +
                                (open ? "" : " to " + std::to_string(range.most));
    if (given == nullptr) return refuse(key, "is not a whole number; give " + allowed);
    if (*given < range.least || *given > range.most)
      return refuse(key, std::to_string(*given) + " is not allowed; give " + allowed);
    value = *given;
  }
  note(key, value);
}

void ConfigFile::take(ConfigKey key, std::string& value) {
  if (const Entry* const entry = find(key)) {
    const std::string* const given = std::get_if<std::string>(&entry->value);
    if (given == nullptr) return refuse(key, "is not text; write it in quotes");
    value = *given;
  }
  note(key, value);
}

void ConfigFile::take(ConfigKey key, std::string& value,
                      const std::vector<std::string_view>& names) {
  take(key, value);
  if (std::find(names.begin(), names.end(), value) != names.end()) return;
  std::string allowed;
  for (const std::string_view name : names)
    allowed += (allowed.empty()        ? "\""
                : name == names.back() ? " or \""
                                       : ", \"") +
               std::string(name) + "\"";
  refuse(key, "\"" + value + "\" is not allowed; give " + allowed);
}

void ConfigFile::take(ConfigKey key, std::vector<std::uint32_t>& value) {
  if (const Entry* const entry = find(key)) {
    const auto* const given = std::get_if<std::vector<std::int64_t>>(&entry->value);
    [[maybe_unused]] static constexpr std::int64_t kMost =
        std::numeric_limits<std::uint32_t>::max();
    const bool good = given != nullptr && std::all_of(given->begin(), given->end(), [](auto one) {
                        return one >= 0 && one <= kMost;
                      });
    if (!good) return refuse(key, "is not a list of numbers of robots; write [1, 2]");
    value.assign(given->begin(), given->end());
  }
  note(key, value);
}

void ConfigFile::take_bytes(ConfigKey key, std::size_t& value) {
  if (const Entry* const entry = find(key)) {
    const auto* const whole = std::get_if<std::int64_t>(&entry->value);
    const auto* const text = std::get_if<std::string>(&entry->value);
    const std::optional<std::size_t> bytes = whole != nullptr  ? parse_bytes(std::to_string(*whole))
                                             : text != nullptr ? parse_bytes(*text)
                                                               : std::nullopt;
    if (!bytes) return refuse(key, "is not a number of bytes; give a whole number, or \"64M\"");
    value = *bytes;
  }
  note(key, value);
}

void ConfigFile::take_number_or(ConfigKey key, std::string& value, std::string_view word) {
  if (const Entry* const entry = find(key)) {
    const auto* const text = std::get_if<std::string>(&entry->value);
    if (text != nullptr && *text == word) {
      value = *text;
    } else if (text == nullptr && (std::holds_alternative<double>(entry->value) ||
                                   std::holds_alternative<std::int64_t>(entry->value))) {
      double number = 0.0;
      take_real(key, number, {});
      value = text_of(number);
    } else {
      return refuse(key, "is neither a number nor \"" + std::string(word) + "\"");
    }
  }
  note(key, value);
}

void ConfigFile::take_path(ConfigKey key, std::string& value) {
  take(key, value);
  if (!is_given(key) || value.empty()) return;
  const std::filesystem::path folder = std::filesystem::path(path_).parent_path();
  value = (folder / value).string();
  note(key, value);
}

void ConfigFile::require(ConfigKey key, std::string_view what) {
  if (is_given(key)) return;
  refuse(key, "is missing; give " + std::string(what));
}

Failure ConfigFile::unknown(const Entry& entry) const {
  const std::string where = path_ + ", line " + std::to_string(entry.line) + ": ";
  const bool is_table = values_.contains(entry.table);
  // The key may be right and the table wrong.
  for (const auto& table : values_.items()) {
    if (table.key() != entry.table && table.value().contains(entry.name)) {
      return {where + "unknown key " + entry.name + " in [" + entry.table + "]; it is in [" +
              table.key() + "]"};
    }
  }
  if (!is_table) {
    return {where + "unknown table [" + entry.table + "]; did you mean [" +
            nearest(entry.table, keys_of(values_)) + "]?"};
  }
  return {where + "unknown key " + entry.name + " in [" + entry.table + "]; did you mean " +
          nearest(entry.name, keys_of(values_[entry.table])) + "?"};
}

Outcome<void> ConfigFile::finish() const {
  for (const Table& table : tables_) {
    if (!values_.contains(table.name))
      return unknown({.table = table.name, .name = {}, .line = table.line, .value = {}});
  }
  // First of all: an unknown key explains the one that is missing because of it.
  for (const Entry& entry : entries_) {
    if (!values_[entry.table].contains(entry.name)) return unknown(entry);
  }
  if (failure_) return *failure_;
  return {};
}

}  // namespace tessera
