// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A TOML file of tables with keys, read strictly: refuses unknown keys, with the nearest known
// name, and every value of another type or out of its range, with its line.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "base/json.hpp"
#include "base/outcome.hpp"
#include "settings/setting.hpp"

namespace tessera {

/// Where the keys of a configuration file are.
class ConfigPlaces {
 public:
  ConfigPlaces() = default;
  explicit ConfigPlaces(std::string path) : path_(std::move(path)) {}
  /// item: of an array of tables, from 1; else 0.
  void note(std::string table, std::string key, std::size_t line, std::size_t item = 0) {
    lines_.push_back({std::move(table), std::move(key), line, item});
  }
  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] bool has_table(std::string_view table) const { return line_of(table, "") != 0; }
  [[nodiscard]] bool is_given(const SettingName& setting) const {
    return line_of(setting.table, setting.key) != 0;
  }
  /// "path, line n: [table] key: what" about the setting that the message names first, with the
  /// line of its key, or of its table; about no setting of a file: the failure as it is. item: as
  /// in note().
  [[nodiscard]] Failure worded(const Failure& failure, std::size_t item = 0) const;

 private:
  struct Line {
    std::string table;
    std::string key;  ///< Empty: the table's own.
    std::size_t line;
    std::size_t item;
  };
  /// 0: it is not in the file.
  [[nodiscard]] std::size_t line_of(std::string_view table, std::string_view key,
                                    std::size_t item = 0) const;

  std::string path_;
  std::vector<Line> lines_;
};

/// finish() returns the first error of all that was read.
class ConfigFile {
 public:
  /// Fails with kUsage, naming the line, iff text is not TOML, or has a key outside of a table, a
  /// table within a table, or a value of a type that no setting has. path: for messages.
  static Outcome<ConfigFile> parse(std::string_view text, std::string path);

  /// Sets what is given, and leaves the rest.
  template <class Options>
  void read(const SettingTable<Options>& table, std::type_identity_t<Options>& options) {
    for (const Setting& row : table.rows) read(row, &options);
  }
  /// The same of an array of tables, such as [[sessions]]: adds what is given of each to options.
  template <class Options>
  void read_all(const SettingTable<Options>& table, std::vector<Options>& options) {
    const std::string name(table.rows.front().name.table);
    values_[name] = Json::array();
    const std::size_t items = count_items(name);
    for (item_ = 1; item_ <= items; ++item_) {
      options.emplace_back();
      for (const Setting& row : table.rows) read(row, &options.back());
    }
    item_ = 0;
  }

  /// Fails with kUsage iff there is a key or table that was not read, a required one is missing, or
  /// there was an error in one that was read.
  [[nodiscard]] Outcome<void> finish() const;
  [[nodiscard]] const ConfigPlaces& places() const { return places_; }
  /// All keys that were read, with their values.
  [[nodiscard]] const Json& values() const { return values_; }

 private:
  using Value = std::variant<bool, std::int64_t, double, std::string, std::vector<std::int64_t>,
                             std::vector<double>>;
  struct Entry {
    std::string table;
    std::string name;
    std::size_t line = 0;
    Value value;
    std::size_t item = 0;  ///< Of an array of tables, from 1.
  };

  ConfigFile() = default;
  [[nodiscard]] const Entry* find(const SettingName& setting) const;
  void read(const Setting& setting, void* options);
  [[nodiscard]] Outcome<SettingValue> value_of(const Setting& setting, const Entry& entry) const;
  void refuse(const Failure& failure);
  [[nodiscard]] std::size_t count_items(std::string_view table) const;
  [[nodiscard]] const Json& keys_in(const std::string& table) const;
  [[nodiscard]] std::optional<Failure> misplaced(const Entry& table) const;
  [[nodiscard]] Failure unknown(const Entry& entry) const;

  ConfigPlaces places_;
  std::vector<Entry> entries_;
  std::vector<Entry> tables_;  ///< Without name and value.
  Json values_ = Json::object();
  std::optional<Failure> failure_;
  std::size_t item_ = 0;  ///< That is read.
};

}  // namespace tessera
