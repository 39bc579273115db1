// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "settings.hpp"

#include <pybind11/stl/filesystem.h>

#include <filesystem>
#include <vector>

namespace tessera::python {

namespace {

/// Of Python or NumPy, whose class is "bool_" before its version 2.
bool is_bool(const py::handle& value) {
  const std::string type = py::str(py::type::of(value).attr("__name__"));
  return type == "bool" || type == "bool_";
}

/// A number in Python or NumPy, and neither True nor text.
bool is_number(const py::handle& value) {
  if (is_bool(value) || py::isinstance<py::str>(value)) return false;
  return PyNumber_Check(value.ptr()) != 0 && py::hasattr(value, "__float__") &&
         !py::hasattr(value, "__len__");
}

/// A type for a docstring, and in words.
struct TypeNames {
  const char* annotation;
  const char* words;
};

TypeNames type_of(SettingKind kind) {
  switch (kind) {
    case SettingKind::kSwitch:
      return {"bool", "True or False"};
    case SettingKind::kReal:
      return {"float", "a number"};
    case SettingKind::kWhole:
    case SettingKind::kBytes:
      return {"int", "a whole number"};
    case SettingKind::kChoice:
    case SettingKind::kText:
      return {"str", "text"};
    case SettingKind::kPath:
      return {"str", "a path"};
    case SettingKind::kReals:
      return {"list", "a list of numbers"};
    case SettingKind::kNumbers:
      break;
  }
  return {"list", "a list of whole numbers"};
}

[[noreturn]] void raise_wrong_type(const Setting& setting, const py::handle& value) {
  const std::string type = py::str(py::type::of(value).attr("__name__"));
  raise_type(name_of(setting.name, Speaker::kPython) + " is of type " + type + "; give " +
             type_of(setting.kind).words);
}

/// Exact; raises InputError for one that no setting can have.
SettingValue whole_of(const Setting& setting, const py::handle& value) {
  const auto index = py::reinterpret_steal<py::object>(PyNumber_Index(value.ptr()));
  if (!index) throw py::error_already_set();
  std::int64_t whole = 0;
  int overflow = 0;
  if (setting.member.wide) {
    whole = static_cast<std::int64_t>(PyLong_AsUnsignedLongLong(index.ptr()));
    overflow = PyErr_Occurred() != nullptr ? 1 : 0;
    PyErr_Clear();
  } else {
    whole = PyLong_AsLongLongAndOverflow(index.ptr(), &overflow);
  }
  if (overflow != 0) raise(not_allowed(setting.name, py::str(index), allowed_text(setting)));
  return whole;
}

std::vector<double> reals_of(const Setting& setting, const py::handle& value) {
  std::vector<double> reals;
  if (value.is_none()) return reals;
  if (py::isinstance<py::str>(value) || PySequence_Check(value.ptr()) == 0)
    raise_wrong_type(setting, value);
  for (const py::handle item : py::reinterpret_borrow<py::sequence>(value)) {
    if (!is_number(item)) raise_wrong_type(setting, value);
    reals.push_back(item.cast<double>());
  }
  return reals;
}

SettingValue value_from(const Setting& setting, const py::handle& value) {
  if (value.is_none() && setting.member.optional) return std::monostate();
  const SettingKind kind = setting.kind;
  if (kind == SettingKind::kSwitch && is_bool(value)) return value.cast<bool>();
  if (kind == SettingKind::kReal && is_number(value)) return value.cast<double>();
  const bool counts = kind == SettingKind::kWhole || kind == SettingKind::kBytes;
  if (counts && is_number(value) && PyIndex_Check(value.ptr()) != 0)
    return whole_of(setting, value);
  if (kind == SettingKind::kReals) return reals_of(setting, value);
  const bool is_text = py::isinstance<py::str>(value);
  if (kind == SettingKind::kChoice && is_text) return value.cast<std::string>();
  const bool is_path = kind == SettingKind::kPath && py::hasattr(value, "__fspath__");
  if (kind != SettingKind::kPath && kind != SettingKind::kText) raise_wrong_type(setting, value);
  if (value.is_none()) return std::string();
  if (!is_text && !is_path) raise_wrong_type(setting, value);
  std::string text = value.cast<std::filesystem::path>().string();
  if (text.empty())
    raise({Message(setting.name) + " is empty; give " + allowed_text(setting) + ", or None"});
  return text;
}

}  // namespace

void detail::take_settings(py::dict& given, std::span<const Setting> rows, void* options,
                           bool fixed) {
  for (const Setting& row : rows) {
    const std::string name = name_of(row.name, Speaker::kPython);
    if ((row.fixed && !fixed) || !given.contains(name)) continue;
    const Outcome<void> done = assign(row, options, value_from(row, given[name.c_str()]));
    if (!done.ok()) raise(done.failure());
    given.attr("pop")(name);
  }
}

std::string arguments_text(std::span<const Setting> rows, const void* defaults, bool fixed) {
  const auto text_of_default = [](const SettingValue& value) -> std::string {
    if (const auto* const text = std::get_if<std::string>(&value))
      return text->empty() ? "None" : "'" + *text + "'";
    if (const auto* const on = std::get_if<bool>(&value)) return *on ? "True" : "False";
    if (const auto* const whole = std::get_if<std::int64_t>(&value)) return std::to_string(*whole);
    const auto* const real = std::get_if<double>(&value);
    return real == nullptr ? "None" : std::string(py::repr(py::float_(*real)));
  };
  std::string text;
  for (const Setting& row : rows) {
    if (row.fixed && !fixed) continue;
    const std::string value = text_of_default(row.member.get(defaults));
    text += (text.empty() ? "" : ", ") + name_of(row.name, Speaker::kPython) + ": " +
            type_of(row.kind).annotation + (value == "None" ? " | None" : "") + " = " + value;
  }
  return text;
}

void refuse_others(const py::dict& given, const char* function) {
  for (const auto& [name, value] : given)
    raise_type(std::string(function) + " has no argument " + std::string(py::str(name)) +
               "; help(tessera." + function + ") lists them");
}

}  // namespace tessera::python
