// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A TOML file of tables with keys, read strictly: refuses unknown keys, with the nearest known
// name, and every value of another type or out of its range, with its line.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "base/json.hpp"
#include "base/outcome.hpp"

namespace tessera {

/// "[table] key".
struct ConfigKey {
  const char* table;
  const char* name;
};

/// Each take() is for one key: sets value if the key is given, and leaves it otherwise. finish()
/// returns the first error.
class ConfigFile {
 public:
  struct Real {
    double least = -std::numeric_limits<double>::max();
    double most = std::numeric_limits<double>::max();
  };
  struct Whole {
    std::int64_t least = 0;
    std::int64_t most = std::numeric_limits<std::int64_t>::max();
  };

  /// Fails with kUsage, naming the line, iff text is not TOML, or has a key outside of a table, a
  /// table within a table, or a value of a type that no take() takes. path: for messages.
  static Outcome<ConfigFile> parse(std::string_view text, std::string path);

  void take(ConfigKey key, bool& value);
  void take(ConfigKey key, double& value, Real range);
  void take(ConfigKey key, std::optional<double>& value, Real range);
  void take(ConfigKey key, std::string& value);
  /// One of these names.
  void take(ConfigKey key, std::string& value, const std::vector<std::string_view>& names);
  void take(ConfigKey key, std::vector<std::uint32_t>& value);
  template <class Integer>
  void take(ConfigKey key, Integer& value, Whole range) {
    std::int64_t wide = static_cast<std::int64_t>(value);
    take_whole(key, wide, range);
    value = static_cast<Integer>(wide);
  }
  template <class Integer>
  void take(ConfigKey key, std::optional<Integer>& value, Whole range) {
    if (!is_given(key)) return note(key, Json());
    std::int64_t wide = 0;
    take_whole(key, wide, range);
    value = static_cast<Integer>(wide);
  }
  /// Bytes: a whole number, or text such as "512M".
  void take_bytes(ConfigKey key, std::size_t& value);
  /// A number, or this word; value is the text of either.
  void take_number_or(ConfigKey key, std::string& value, std::string_view word);
  /// A file or folder, relative to the folder of the configuration.
  void take_path(ConfigKey key, std::string& value);
  /// Requires the key. Call it before the key is taken.
  void require(ConfigKey key, std::string_view what);

  /// Fails with kUsage iff there is a key or table that was not taken, or an error in one that was.
  [[nodiscard]] Outcome<void> finish() const;
  /// "path, line n: [table] key: what" with the line of the key, or of its table, if it has one.
  [[nodiscard]] Failure refusal(ConfigKey key, const std::string& what) const;
  [[nodiscard]] bool is_given(ConfigKey key) const { return find(key) != nullptr; }
  [[nodiscard]] bool has_table(std::string_view name) const {
    return std::any_of(tables_.begin(), tables_.end(),
                       [name](const Table& table) { return table.name == name; });
  }
  /// All taken keys with their values.
  [[nodiscard]] const Json& values() const { return values_; }

 private:
  using Value = std::variant<bool, std::int64_t, double, std::string, std::vector<std::int64_t>>;
  struct Entry {
    std::string table;
    std::string name;
    std::size_t line = 0;
    Value value;
  };
  struct Table {
    std::string name;
    std::size_t line = 0;
  };

  ConfigFile() = default;
  [[nodiscard]] const Entry* find(ConfigKey key) const;
  void take_whole(ConfigKey key, std::int64_t& value, Whole range);
  void take_real(ConfigKey key, double& value, Real range);
  void refuse(ConfigKey key, const std::string& what);
  void note(ConfigKey key, Json value);
  [[nodiscard]] Failure unknown(const Entry& entry) const;

  std::string path_;
  std::vector<Table> tables_;
  std::vector<Entry> entries_;
  Json values_ = Json::object();
  std::optional<Failure> failure_;
};

}  // namespace tessera
