// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "scans/dataset_classes.hpp"

#include <array>
#include <cstddef>
#include <filesystem>
#include <initializer_list>
#include <system_error>

#include "base/input_file.hpp"
#include "base/number_row.hpp"

namespace tessera {
namespace {

struct StandardClass {
  std::string_view name;
  Color color;
  std::initializer_list<std::uint16_t> raw_ids;
};

}  // namespace

DatasetClasses DatasetClasses::semantic_kitti() {
  const std::array<StandardClass, 19> standard{{
      {"car", {100, 150, 245}, {10, 252}},
      {"bicycle", {100, 230, 245}, {11}},
      {"motorcycle", {30, 60, 150}, {15}},
      {"truck", {80, 30, 180}, {18, 258}},
      {"other-vehicle", {100, 80, 250}, {13, 16, 20, 256, 257, 259}},
      {"person", {255, 30, 30}, {30, 254}},
      {"bicyclist", {255, 40, 200}, {31, 253}},
      {"motorcyclist", {150, 30, 90}, {32, 255}},
      {"road", {255, 0, 255}, {40, 60}},
      {"parking", {255, 150, 255}, {44}},
      {"sidewalk", {75, 0, 75}, {48}},
      {"other-ground", {175, 0, 75}, {49}},
      {"building", {255, 200, 0}, {50}},
      {"fence", {255, 120, 50}, {51}},
      {"vegetation", {0, 175, 0}, {70}},
      {"trunk", {135, 60, 0}, {71}},
      {"terrain", {150, 240, 80}, {72}},
      {"pole", {255, 240, 150}, {80}},
      {"traffic-sign", {255, 0, 0}, {81}},
  }};
  ClassTable table;
  for (const StandardClass& entry : standard) static_cast<void>(table.add(entry.name, entry.color));
  DatasetClasses classes(table);
  int label = 0;
  for (const StandardClass& entry : standard) classes.assign(entry.raw_ids, ++label);
  // Unlabelled, outlier, other-structure, other-object.
  classes.assign(std::array<std::uint16_t, 4>{0, 1, 52, 99}, classes.unlabelled());
  return classes;
}

DatasetClasses DatasetClasses::numbered(const ClassTable& table) {
  DatasetClasses classes(table);
  for (int label = 1; label <= table.num_classes(); ++label)
    classes.components_[static_cast<std::size_t>(label)] = static_cast<std::uint8_t>(label);
  classes.components_[0] = classes.unlabelled();
  return classes;
}

Outcome<DatasetClasses> DatasetClasses::load(const std::string& folder) {
  const std::string path = (std::filesystem::path(folder) / "classes.toml").string();
  std::error_code error;
  if (std::filesystem::status(path, error).type() == std::filesystem::file_type::not_found) {
    return semantic_kitti();
  }
  TESSERA_TRY_ASSIGN(const std::string text, read_text_file(path, kMostDescriptionBytes));
  return parse(text, path);
}

DatasetClasses DatasetClasses::without(std::span<const std::uint16_t> raw_ids) const {
  DatasetClasses classes = *this;
  classes.assign(raw_ids, unlabelled());
  return classes;
}

void DatasetClasses::assign(std::span<const std::uint16_t> raw_ids, int component) {
  for (const std::uint16_t raw_id : raw_ids) {
    components_[raw_id] = static_cast<std::uint8_t>(component);
  }
}

}  // namespace tessera
