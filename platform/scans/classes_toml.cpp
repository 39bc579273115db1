// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Reads classes.toml. Every refusal names the file, the line and what to write instead.
#include <fmt/core.h>
#include <toml++/toml.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "base/number_row.hpp"
#include "base/toml_nesting.hpp"
#include "scans/dataset_classes.hpp"

namespace tessera {
namespace {

struct ParsedClass {
  int id = 0;
  std::string name;
  Color color;
  std::vector<std::uint16_t> raw_ids;
  bool moves = false;
  std::size_t line = 0;
};

struct ParsedClasses {
  std::vector<ParsedClass> classes;  ///< In the order of their ids after the check.
  std::vector<std::uint16_t> unlabelled;
};

std::size_t line_of(const toml::node& node) { return node.source().begin.line; }

/// One pass over the file; holds what messages and the check for repeated raw ids need.
class ClassesReader {
 public:
  explicit ClassesReader(const std::string& path) : path_(path), line_of_raw_(65536, 0) {}

  Outcome<ParsedClasses> read(const toml::table& root) {
    ParsedClasses parsed;
    const toml::array* entries = root["class"].as_array();
    if (entries == nullptr || entries->empty()) {
      return Failure{path_ + " has no [[class]] entry; add one for each class, or remove the file"};
    }
    for (const toml::node& node : *entries) {
      const toml::table* entry = node.as_table();
      if (entry == nullptr) return refusal(node, "class is not a table", "write [[class]]");
      TESSERA_TRY_ASSIGN(ParsedClass one, read_class(*entry));
      parsed.classes.push_back(std::move(one));
    }
    TESSERA_TRY(sort_and_check_ids(parsed.classes));
    if (const toml::node* node = root.get("unlabelled")) {
      TESSERA_TRY_ASSIGN(std::vector<std::uint16_t> raw_ids, read_raw_ids(*node));
      parsed.unlabelled = std::move(raw_ids);
    }
    return parsed;
  }

 private:
  Failure refusal(const toml::node& node, std::string_view what, std::string_view remedy) const {
    return text_failure({path_, line_of(node)}, what, remedy);
  }

  Outcome<ParsedClass> read_class(const toml::table& entry) {
    for (const char* key : {"id", "name", "color", "raw"}) {
      if (!entry.contains(key)) {
        return refusal(entry, std::string("this class has no '") + key + "'",
                       "each [[class]] needs id, name, color and raw");
      }
    }
    ParsedClass parsed;
    parsed.line = line_of(entry);
    const toml::node& id = *entry.get("id");
    const std::int64_t number = id.is_integer() ? id.as_integer()->get() : 0;
    if (number < 1 || number > kMaxClasses) {
      return refusal(id, fmt::format("id is not a whole number from 1 to {}", kMaxClasses),
                     "number the classes 1, 2, 3, ...");
    }
    parsed.id = static_cast<int>(number);
    TESSERA_TRY_ASSIGN(std::string name, read_name(*entry.get("name")));
    parsed.name = std::move(name);
    TESSERA_TRY_ASSIGN(const Color color, read_color(*entry.get("color")));
    parsed.color = color;
    TESSERA_TRY_ASSIGN(std::vector<std::uint16_t> raw_ids, read_raw_ids(*entry.get("raw")));
    parsed.raw_ids = std::move(raw_ids);
    parsed.moves = moves_by_name(parsed.name);
    if (const toml::node* moves = entry.get("moves")) {
      if (!moves->is_boolean())
        return refusal(*moves, "moves is not true or false", "write moves = true, or leave it out");
      parsed.moves = moves->as_boolean()->get();
    }
    return parsed;
  }

  Outcome<std::string> read_name(const toml::node& node) {
    constexpr std::size_t kMaxBytes = SemanticClass::kNameBytes - 1;
    const std::string name = node.is_string() ? node.as_string()->get() : std::string();
    if (name.empty() || name.size() > kMaxBytes || name.find('\0') != std::string::npos) {
      return refusal(node, fmt::format("name is not a text of 1 to {} bytes", kMaxBytes),
                     "write a short name in quotes");
    }
    if (std::find(names_.begin(), names_.end(), name) != names_.end()) {
      return refusal(node, "duplicate name '" + name + "'", "give each class its own name");
    }
    names_.push_back(name);
    return name;
  }

  Outcome<Color> read_color(const toml::node& node) const {
    std::optional<Color> color;
    if (const toml::array* parts = node.as_array()) color = color_from(*parts);
    if (const auto* text = node.as_string()) color = color_from(text->get());
    if (color) return *color;
    return refusal(node, "color is not a colour",
                   "write [red, green, blue] with 0 to 255 each, or \"#rrggbb\"");
  }

  static std::optional<Color> color_from(const toml::array& parts) {
    if (parts.size() != 3) return std::nullopt;
    std::array<std::uint8_t, 3> channels{};
    for (std::size_t i = 0; i < channels.size(); ++i) {
      const auto* value = parts[i].as_integer();
      if (value == nullptr || value->get() < 0 || value->get() > 255) return std::nullopt;
      channels[i] = static_cast<std::uint8_t>(value->get());
    }
    return Color{channels[0], channels[1], channels[2]};
  }

  static std::optional<Color> color_from(std::string_view text) {
    constexpr std::size_t kBytes = 7;
    std::uint32_t rgb = 0;
    if (text.size() != kBytes || text[0] != '#') return std::nullopt;
    const char* const end = text.data() + kBytes;
    const auto [stopped, error] = std::from_chars(text.data() + 1, end, rgb, 16);
    if (error != std::errc{} || stopped != end) return std::nullopt;
    const auto channel = [rgb](unsigned shift) {
      return static_cast<std::uint8_t>(rgb >> shift & 0xFFU);
    };
    return Color{channel(16), channel(8), channel(0)};
  }

  Outcome<std::vector<std::uint16_t>> read_raw_ids(const toml::node& node) {
    constexpr std::string_view kRemedy = "write a list of whole numbers from 0 to 65535";
    const toml::array* list = node.as_array();
    if (list == nullptr) return refusal(node, "the raw ids are not a list", kRemedy);
    std::vector<std::uint16_t> raw_ids;
    for (const toml::node& item : *list) {
      const std::int64_t raw_id = item.is_integer() ? item.as_integer()->get() : -1;
      if (raw_id < 0 || raw_id > 65535) return refusal(item, "a raw id is out of range", kRemedy);
      std::size_t& earlier_line = line_of_raw_[static_cast<std::size_t>(raw_id)];
      if (earlier_line != 0) {
        return refusal(item,
                       fmt::format("duplicate raw id {}, also in line {}", raw_id, earlier_line),
                       "keep one of them");
      }
      earlier_line = line_of(item);
      raw_ids.push_back(static_cast<std::uint16_t>(raw_id));
    }
    return raw_ids;
  }

  Outcome<void> sort_and_check_ids(std::vector<ParsedClass>& classes) const {
    std::stable_sort(classes.begin(), classes.end(),
                     [](const ParsedClass& a, const ParsedClass& b) { return a.id < b.id; });
    int expected = 0;
    for (const ParsedClass& one : classes) {
      if (one.id == expected) {
        return text_failure({path_, one.line}, fmt::format("duplicate id {}", one.id),
                            "give each class its own id");
      }
      if (one.id != ++expected) {
        return text_failure(
            {path_, one.line},
            fmt::format("the ids have a gap: there is {} but no {}", one.id, expected),
            "number the classes 1, 2, 3, ... without gaps");
      }
    }
    return {};
  }

  const std::string& path_;
  std::vector<std::size_t> line_of_raw_;  ///< By raw id; 0: not seen yet.
  std::vector<std::string> names_;
};

}  // namespace

Outcome<DatasetClasses> DatasetClasses::parse(std::string_view text, const std::string& path) {
  TESSERA_TRY(check_nesting(text, path));
  try {
    TESSERA_TRY_ASSIGN(const ParsedClasses parsed, ClassesReader(path).read(toml::parse(text)));
    ClassTable table;
    for (const ParsedClass& one : parsed.classes) {
      static_cast<void>(table.add(one.name, one.color, one.moves));
    }
    DatasetClasses classes(table);
    for (const ParsedClass& one : parsed.classes) classes.assign(one.raw_ids, one.id);
    classes.assign(parsed.unlabelled, classes.unlabelled());
    return classes;
  } catch (const toml::parse_error& error) {
    return text_failure({path, error.source().begin.line},
                        "not valid TOML (" + std::string(error.description()) + ")",
                        "fix the syntax");
  }
}

}  // namespace tessera
