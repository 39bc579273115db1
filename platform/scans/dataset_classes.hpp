// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Maps raw label ids of a dataset to classes: the nineteen of SemanticKITTI unless the folder has a
// classes.toml.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/outcome.hpp"
#include "tessera/semantics/class_table.hpp"

namespace tessera {

class DatasetClasses {
 public:
  /// SemanticKITTI's standard map: 1 car .. 19 traffic-sign.
  [[nodiscard]] static DatasetClasses semantic_kitti();
  /// Classes whose raw ids are their labels; 0 is known to be unlabelled.
  [[nodiscard]] static DatasetClasses numbered(const ClassTable& table);
  /// text: the content of a classes.toml; path: for messages. Fails with kUsage, naming file, line
  /// and remedy, iff it is not TOML or not a gapless table of 1 .. 62 classes whose raw ids differ.
  static Outcome<DatasetClasses> parse(std::string_view text, const std::string& path);
  /// folder/classes.toml if it exists, else semantic_kitti(). Fails as parse() and
  /// read_text_file() do.
  static Outcome<DatasetClasses> load(const std::string& folder);

  /// The same, but these ids are known to be unlabelled.
  [[nodiscard]] DatasetClasses without(std::span<const std::uint16_t> raw_ids) const;

  [[nodiscard]] const ClassTable& table() const noexcept { return table_; }
  /// 1 .. C, or C + 1 if the id is unlabelled or unknown. O(1).
  [[nodiscard]] std::uint8_t component(std::uint16_t raw_id) const noexcept {
    const std::uint8_t component = components_[raw_id];
    return component == kUnknown ? unlabelled() : component;
  }
  /// False iff the id is neither in a class nor among the unlabelled ones.
  [[nodiscard]] bool is_known(std::uint16_t raw_id) const noexcept {
    return components_[raw_id] != kUnknown;
  }
  [[nodiscard]] std::uint8_t unlabelled() const noexcept {
    return static_cast<std::uint8_t>(table_.unlabelled());
  }

 private:
  static constexpr std::uint8_t kUnknown = 0;  // Component 0, free, comes from no label.
  static constexpr std::size_t kRawIds = 65536;

  explicit DatasetClasses(const ClassTable& table)
      : table_(table), components_(kRawIds, kUnknown) {}
  void assign(std::span<const std::uint16_t> raw_ids, int component);

  ClassTable table_;
  std::vector<std::uint8_t> components_;
};

}  // namespace tessera
