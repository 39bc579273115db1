// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Labels of points in arrays of numpy, with weights or without.
#pragma once

#include <pybind11/numpy.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "errors.hpp"
#include "scans/dataset_classes.hpp"
#include "scans/scan.hpp"

namespace tessera::python {

/// Labels of count points, not yet converted: uint8 are components, uint16 and uint32 raw ids, of
/// which the lower 16 bits are used.
struct LabelsView {
  const std::byte* data = nullptr;  ///< Null: none were given.
  std::ptrdiff_t stride_bytes = 0;
  std::ptrdiff_t column_bytes = 0;
  std::size_t width_bytes = 0;
  std::size_t count = 0;
  std::size_t per_point = 1;
  bool is_table = false;  ///< (count, per_point), not (count,).

  [[nodiscard]] bool are_components() const noexcept { return width_bytes == 1; }
};
/// Raises TypeError iff it is of another type, InputError iff the shape is not (count,), or with
/// several (count, 1 .. kMostLabels).
[[nodiscard]] LabelsView labels_of(const std::optional<py::array>& array, std::size_t count,
                                   const char* name, bool several = false);
/// Weights of labels in 255ths, as ScanView has them: in the array itself if it is of uint8 without
/// gaps, else in scratch. Raises TypeError iff it is neither of uint8 nor of float32 or float64,
/// InputError iff it has another shape than labels, or probabilities of a point are negative, not
/// finite or sum to more than one.
[[nodiscard]] const std::uint8_t* label_weights_of(const py::array& array, const LabelsView& labels,
                                                   std::vector<std::uint8_t>& scratch);
/// The components: in the array itself if it has them without gaps, else in scratch. classes: may
/// be null if the labels are components. weights: of label_weights_of(), or null; what has none is
/// not unknown. Needs no GIL.
[[nodiscard]] const std::uint8_t* components_of(const LabelsView& labels,
                                                const DatasetClasses* classes,
                                                const std::uint8_t* weights,
                                                std::vector<std::uint8_t>& scratch,
                                                UnknownRawIds& unknown);

}  // namespace tessera::python
