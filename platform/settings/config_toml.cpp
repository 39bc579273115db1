// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Reads TOML into the flat list of a ConfigFile.
#include <toml++/toml.h>

#include <algorithm>
#include <utility>

#include "base/number_row.hpp"
#include "base/toml_nesting.hpp"
#include "settings/config_file.hpp"

namespace tessera {

namespace {

std::size_t line_of(const toml::node& node) { return node.source().begin.line; }

}  // namespace

Outcome<ConfigFile> ConfigFile::parse(std::string_view text, std::string path) {
  ConfigFile file;
  file.places_ = ConfigPlaces(std::move(path));
  const auto refused = [&file](const toml::node& node, const std::string& what,
                               const char* remedy) {
    return text_failure({file.places_.path(), line_of(node)}, what, remedy);
  };
  const auto value_of = [](const toml::node& node) -> std::optional<Value> {
    if (const auto* const one = node.as_boolean()) return Value(one->get());
    if (const auto* const one = node.as_integer()) return Value(one->get());
    if (const auto* const one = node.as_floating_point()) return Value(one->get());
    if (const auto* const one = node.as_string()) return Value(one->get());
    const toml::array* const list = node.as_array();
    if (list == nullptr) return std::nullopt;
    std::vector<std::int64_t> wholes;
    std::vector<double> reals;
    for (const toml::node& item : *list) {
      if (!item.is_number()) return std::nullopt;
      // value<double>() has none for whole numbers beyond 2^53.
      if (item.is_integer()) wholes.push_back(item.as_integer()->get());
      reals.push_back(item.is_integer() ? static_cast<double>(wholes.back())
                                        : item.as_floating_point()->get());
    }
    return wholes.size() == reals.size() ? Value(std::move(wholes)) : Value(std::move(reals));
  };
  TESSERA_TRY(check_nesting(text, file.places_.path()));
  try {
    const toml::table root = toml::parse(text);
    const auto take = [&](const std::string& table_name, const toml::table& table,
                          std::size_t item) -> Outcome<void> {
      file.tables_.push_back({table_name, {}, line_of(table), {}, item});
      for (const auto& [key, value] : table) {
        std::optional<Value> taken = value_of(value);
        const std::string key_name(key.str());
        if (!taken) {
          std::string what = "[";
          what.append(table_name).append("] ").append(key_name).append(" has an unsupported type");
          return refused(value, what, "give text, a number, true or false, or a list of numbers");
        }
        file.entries_.push_back({table_name, key_name, line_of(value), std::move(*taken), item});
      }
      return {};
    };
    for (const auto& [name, node] : root) {
      const std::string table_name(name.str());
      if (const toml::table* const table = node.as_table(); table != nullptr) {
        TESSERA_TRY(take(table_name, *table, 0));
      } else if (node.is_array_of_tables()) {
        std::size_t item = 0;
        for (const toml::node& one : *node.as_array())
          TESSERA_TRY(take(table_name, *one.as_table(), ++item));
      } else {
        return refused(node, std::string(table_name).append(" is not in a table"),
                       "put it below a line such as [robot]");
      }
    }
  } catch (const toml::parse_error& error) {
    return text_failure({file.places_.path(), error.source().begin.line},
                        "not valid TOML (" + std::string(error.description()) + ")",
                        "fix the syntax");
  }
  // The table is sorted by names, and messages must be about the first line.
  for (std::vector<Entry>* const all : {&file.entries_, &file.tables_}) {
    std::stable_sort(all->begin(), all->end(),
                     [](const Entry& a, const Entry& b) { return a.line < b.line; });
    for (const Entry& entry : *all)
      file.places_.note(entry.table, entry.name, entry.line, entry.item);
  }
  return file;
}

}  // namespace tessera
