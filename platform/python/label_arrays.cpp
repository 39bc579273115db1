// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "label_arrays.hpp"

#include <fmt/core.h>

#include <array>
#include <cstring>
#include <string>

#include "array_checks.hpp"
#include "tessera/registration/point_labels.hpp"

namespace tessera::python {

LabelsView labels_of(const std::optional<py::array>& array, std::size_t count, const char* name,
                     bool several) {
  LabelsView labels;
  labels.count = count;
  labels.width_bytes = 1;
  if (!array) return labels;
  const std::string n(name);
  const bool known =
      is_of<std::uint8_t>(*array) || is_of<std::uint16_t>(*array) || is_of<std::uint32_t>(*array);
  if (!known) {
    const std::string is = n + " is of " + type_of(*array);
    const std::string as_raw_ids = n + ".astype(numpy.uint32)";
    if (n == "raw_ids") raise_type(is + "; give uint16 or uint32: " + as_raw_ids);
    raise_type(is + "; give " + n + ".astype(numpy.uint8) if they are classes 1 .. C, " +
               as_raw_ids + " if they are raw ids of the data set");
  }
  const bool is_list = array->ndim() == 1 && static_cast<std::size_t>(array->shape(0)) == count;
  const bool is_table = several && array->ndim() == 2 &&
                        static_cast<std::size_t>(array->shape(0)) == count &&
                        array->shape(1) >= 1 && array->shape(1) <= py::ssize_t{kMostLabels};
  if (!is_list && !is_table) {
    refuse_shape(*array, n,
                 several ? fmt::format("one to {} for each of the {} points", kMostLabels, count)
                         : fmt::format("one for each of the {} points", count));
  }
  labels.is_table = is_table;
  if (is_table) {
    labels.per_point = static_cast<std::size_t>(array->shape(1));
    labels.column_bytes = array->strides(1);
  }
  // An empty array may have no memory, but it was given.
  static constexpr std::byte kNothing{};
  labels.data = count == 0 ? &kNothing : static_cast<const std::byte*>(array->data());
  labels.stride_bytes = array->strides(0);
  labels.width_bytes = static_cast<std::size_t>(array->itemsize());
  return labels;
}

namespace {

template <class T>
void quantise_rows(const py::array& array, const LabelsView& labels,
                   std::vector<std::uint8_t>& into) {
  const auto* const data = static_cast<const char*>(array.data());
  const py::ssize_t column_bytes = array.ndim() == 2 ? array.strides(1) : 0;
  std::array<float, kMostLabels> row{};
  for (std::size_t i = 0; i < labels.count; ++i) {
    for (std::size_t j = 0; j < labels.per_point; ++j) {
      T value{};
      std::memcpy(&value,
                  data + static_cast<py::ssize_t>(i) * array.strides(0) +
                      static_cast<py::ssize_t>(j) * column_bytes,
                  sizeof(value));
      row[j] = static_cast<float>(value);
    }
    const Status status =
        quantise_label_weights(std::span(row).first(labels.per_point),
                               std::span(into).subspan(i * labels.per_point, labels.per_point));
    if (status != Status::kOk) {
      throw InputError(fmt::format(
          "label_weights of point {} are negative, not finite or sum to more than one; give "
          "probabilities",
          i));
    }
  }
}

}  // namespace

const std::uint8_t* label_weights_of(const py::array& array, const LabelsView& labels,
                                     std::vector<std::uint8_t>& scratch) {
  const bool is_bytes = is_of<std::uint8_t>(array);
  const bool is_single = is_of<float>(array);
  if (!is_bytes && !is_single && !is_of<double>(array)) {
    raise_type("label_weights is of " + type_of(array) +
               "; give float32 or float64 probabilities, or uint8 in 255ths");
  }
  const bool same =
      labels.data != nullptr && array.ndim() == (labels.is_table ? 2 : 1) &&
      static_cast<std::size_t>(array.shape(0)) == labels.count &&
      (!labels.is_table || static_cast<std::size_t>(array.shape(1)) == labels.per_point);
  if (!same) refuse_shape(array, "label_weights", "one for each of labels");
  const std::size_t all = labels.count * labels.per_point;
  if (is_bytes && (array.flags() & py::array::c_style) != 0)
    return static_cast<const std::uint8_t*>(array.data());
  if (scratch.size() < all) scratch.resize(all);
  if (is_single) {
    quantise_rows<float>(array, labels, scratch);
  } else if (!is_bytes) {
    quantise_rows<double>(array, labels, scratch);
  } else {
    for (std::size_t k = 0; k < all; ++k) {
      const auto row = static_cast<py::ssize_t>(k / labels.per_point);
      const auto column = static_cast<py::ssize_t>(k % labels.per_point);
      scratch[k] = array.ndim() == 2 ? *static_cast<const std::uint8_t*>(array.data(row, column))
                                     : *static_cast<const std::uint8_t*>(array.data(row));
    }
  }
  return scratch.data();
}

const std::uint8_t* components_of(const LabelsView& labels, const DatasetClasses* classes,
                                  const std::uint8_t* weights, std::vector<std::uint8_t>& scratch,
                                  UnknownRawIds& unknown) {
  if (labels.data == nullptr) return nullptr;
  const bool whole_rows = labels.per_point == 1 || labels.column_bytes == 1;
  const bool no_gaps = labels.stride_bytes == static_cast<std::ptrdiff_t>(labels.per_point);
  if (labels.are_components() && whole_rows && (no_gaps || labels.count < 2))
    return reinterpret_cast<const std::uint8_t*>(labels.data);
  const std::size_t all = labels.count * labels.per_point;
  if (scratch.size() < all) scratch.resize(all);
  for (std::size_t k = 0; k < all; ++k) {
    const auto row = static_cast<std::ptrdiff_t>(k / labels.per_point);
    const auto column = static_cast<std::ptrdiff_t>(k % labels.per_point);
    const std::byte* const from =
        labels.data + row * labels.stride_bytes + column * labels.column_bytes;
    if (labels.are_components()) {
      scratch[k] = std::to_integer<std::uint8_t>(*from);
      continue;
    }
    // The lower half of a 32-bit number comes first on all supported machines.
    std::uint16_t raw_id = 0;
    std::memcpy(&raw_id, from, sizeof(raw_id));
    const bool counts = weights == nullptr || weights[k] != 0;
    if (counts && !classes->is_known(raw_id)) unknown.add(raw_id);
    scratch[k] = classes->component(raw_id);
  }
  return scratch.data();
}

}  // namespace tessera::python
