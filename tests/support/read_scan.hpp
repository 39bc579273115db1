// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A recorded scan as the integrator gets it, copied.
#pragma once

#include <cstdint>
#include <vector>

#include "scans/recorded_scans.hpp"

namespace tessera::test {

struct ReadScan : RegistrationRecord {
  int number = 0;
  std::vector<float> points_xyzi;  ///< x y z alone of depth images.
  std::vector<std::uint8_t> components;
  std::vector<std::uint8_t> label_weights;
  UnknownRawIds unknown;
  Matrix34d T_map_sensor = Matrix34d::Identity();

  [[nodiscard]] std::size_t num_points() const { return components.size(); }
};

/// Fails as ScanReader does.
inline Outcome<ReadScan> read_scan(const RecordedScans& scans, std::size_t i) {
  Outcome<ScanReader> reader = ScanReader::make(scans);
  if (!reader.ok()) return reader.failure();
  const Outcome<ScanView> view = reader->read(i);
  if (!view.ok()) return view.failure();
  ReadScan scan;
  static_cast<RegistrationRecord&>(scan) = reader->registration();
  scan.number = reader->scan().number;
  scan.points_xyzi.assign(view->points, view->points + view->count * view->stride_floats);
  const std::size_t labels = view->count * view->labels_per_point;
  scan.components.assign(view->components, view->components + labels);
  if (view->label_weights != nullptr)
    scan.label_weights.assign(view->label_weights, view->label_weights + labels);
  scan.unknown = reader->scan().unknown;
  scan.T_map_sensor = view->T_map_sensor;
  return scan;
}

}  // namespace tessera::test
