// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "class_table.hpp"

#include <fmt/core.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "arrays.hpp"
#include "label_arrays.hpp"

namespace tessera::python {

namespace {

/// A colour that differs from those of the classes before: steps around the colour circle by the
/// golden section.
Color color_of(int label) {
  const double turn = 6.0 * std::fmod(0.618034 * label, 1.0);
  const auto channel = [turn](double shift) {
    const double at = std::fmod(turn + shift, 6.0);
    const double share = std::clamp(std::min(at, 4.0 - at), 0.0, 1.0);
    return static_cast<std::uint8_t>(std::lround(64.0 + 180.0 * share));
  };
  return {channel(2.0), channel(0.0), channel(4.0)};
}

using ColorArray = py::array_t<std::uint8_t, py::array::c_style>;

Classes make(const std::vector<std::string>& names, const std::optional<ColorArray>& colors,
             const std::optional<std::vector<bool>>& moves) {
  if (names.empty() || names.size() > static_cast<std::size_t>(kMaxClasses)) {
    throw InputError(fmt::format("{} names are not a table of classes; give 1 to {}", names.size(),
                                 kMaxClasses));
  }
  const bool fit = !colors || (colors->ndim() == 2 && colors->shape(1) == 3 &&
                               static_cast<std::size_t>(colors->shape(0)) == names.size());
  if (!fit)
    throw InputError("colors is not one row of red, green, blue for each name: give (C, 3)");
  if (moves && moves->size() != names.size())
    throw InputError("moves is not a truth value for each name: give as many");
  ClassTable table;
  int label = 0;
  for (const std::string& name : names) {
    const bool is_new =
        std::find(names.begin(), names.begin() + label, name) == names.begin() + label;
    if (name.empty() || name.size() >= SemanticClass::kNameBytes || !is_new ||
        name.find('\0') != std::string::npos) {
      throw InputError(
          fmt::format("the name '{}' is a duplicate, or not of 1 to {} bytes; give each its own",
                      one_line(name), SemanticClass::kNameBytes - 1));
    }
    Color color = color_of(label);
    if (colors) color = {colors->at(label, 0), colors->at(label, 1), colors->at(label, 2)};
    const bool may_move = moves ? (*moves)[static_cast<std::size_t>(label)] : moves_by_name(name);
    static_cast<void>(table.add(name, color, may_move));
    ++label;
  }
  return classes_of(DatasetClasses::numbered(table));
}

std::vector<std::string> names_of(const Classes& classes) {
  std::vector<std::string> names;
  for (int label = 1; label <= classes.table.num_classes(); ++label)
    names.emplace_back(classes.table[label].name_view());
  return names;
}

py::array_t<std::uint8_t> colors_of(const Classes& classes) {
  auto colors = new_array<std::uint8_t>(static_cast<std::size_t>(classes.table.num_classes()), 3);
  auto at = colors.mutable_unchecked<2>();
  for (int label = 1; label <= classes.table.num_classes(); ++label) {
    const Color& color = classes.table[label].color;
    at(label - 1, 0) = color.r;
    at(label - 1, 1) = color.g;
    at(label - 1, 2) = color.b;
  }
  return colors;
}

std::vector<bool> moves_of(const Classes& classes) {
  std::vector<bool> moves;
  for (int label = 1; label <= classes.table.num_classes(); ++label)
    moves.push_back(classes.table.moves(label));
  return moves;
}

py::array_t<std::uint8_t> components(const Classes& classes, const py::array& raw_ids) {
  const auto count = raw_ids.ndim() == 1 ? static_cast<std::size_t>(raw_ids.shape(0)) : 0;
  const LabelsView labels = labels_of(raw_ids, count, "raw_ids");
  if (labels.are_components()) raise_type("raw_ids is of uint8; give uint16 or uint32");
  if (!classes.raw_ids)
    throw InputError("this table is of a map file, which has no raw ids; use the data set's");
  UnknownRawIds unknown;
  std::vector<std::uint8_t> converted;
  {
    const py::gil_scoped_release released;
    static_cast<void>(components_of(labels, classes.raw_ids.get(), nullptr, converted, unknown));
  }
  return array_taking(std::move(converted));
}

}  // namespace

Classes classes_of(DatasetClasses&& classes) {
  const ClassTable table = classes.table();
  return {table, std::make_shared<const DatasetClasses>(std::move(classes))};
}

void add_class_table(py::module_& module) {
  py::class_<Classes>(module, "ClassTable", R"(The semantic classes of a map, labels 1 .. C.

Component 0 is free, C + 1 is occupied of unknown class. A table also maps the raw ids of a data set
to its classes, unless it is from a map file.)")
      .def(
          py::init(&make), py::arg("names"), py::kw_only(), py::arg("colors") = py::none(),
          py::arg("moves") = py::none(),
          R"(Classes with these names, at most 31 bytes each; label and raw id of a class are its position, from 1.

colors: (C, 3) uint8, red green blue; None: distinct colours. moves: whether things of a class may
move, for each; None: by its name, as vehicles, people and animals do. Raises InputError iff there are not 1 to
62 names, a name is empty, too long or a duplicate, colors has another shape, or moves another length.)")
      .def_static(
          "semantic_kitti", [] { return classes_of(DatasetClasses::semantic_kitti()); },
          "The 19 classes of SemanticKITTI, with its raw ids: 1 car .. 19 traffic-sign.")
      .def_static(
          "load",
          [](const std::string& folder) {
            return classes_of(value_of(DatasetClasses::load(folder)));
          },
          py::arg("folder"),
          "Reads folder/classes.toml; SemanticKITTI's classes if it does not exist. Raises "
          "InputError iff the file is invalid.")
      .def_static(
          "parse",
          [](const std::string& text) {
            return classes_of(value_of(DatasetClasses::parse(text, "text")));
          },
          py::arg("text"),
          "Parses the content of a classes.toml. Raises InputError iff it is invalid.")
      .def_property_readonly("names", &names_of, "Names of classes 1 .. C, in this order.")
      .def_property_readonly("colors", &colors_of,
                             "(C, 3) uint8: red green blue of classes 1 .. C.")
      .def_property_readonly("moves", &moves_of,
                             "Whether things of class 1 .. C may move, a truth value each.")
      .def_property_readonly(
          "num_classes", [](const Classes& c) { return c.table.num_classes(); }, "C.")
      .def_property_readonly(
          "num_components", [](const Classes& c) { return c.table.num_components(); }, "C + 2.")
      .def_property_readonly(
          "unlabelled", [](const Classes& c) { return c.table.unlabelled(); },
          "The component of points of unknown class: C + 1.")
      .def_property_readonly(
          "has_raw_ids", [](const Classes& c) { return c.raw_ids != nullptr; },
          "Whether labels may be raw ids (uint16, uint32); False for the table of a map file.")
      .def(
          "components", &components, py::arg("raw_ids"),
          R"(Converts (N,) uint16 or uint32 raw ids, of which the lower 16 bits are used, to (N,) uint8 components.

An id in no class becomes C + 1. Raises TypeError iff raw_ids is of another type, InputError iff of
another shape or the table has no raw ids.)")
      .def("__len__", [](const Classes& c) { return c.table.num_classes(); })
      .def("__eq__",
           [](const Classes& a, const py::object& b) {
             return py::isinstance<Classes>(b) && a.table == b.cast<const Classes&>().table;
           })
      .def("__repr__", [](const Classes& c) {
        return fmt::format("<tessera.ClassTable of {} classes>", c.table.num_classes());
      });
}

}  // namespace tessera::python
