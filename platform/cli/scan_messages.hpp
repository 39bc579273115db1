// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The messages by which "play" sends a recorded scan.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/outcome.hpp"
#include "scans/scan.hpp"

namespace tessera {

struct ScanToSend {
  std::int64_t stamp_us = 0;
  std::int32_t sensor = 0;
  bool semantic = true;  ///< With components, else as measured, with the times of points.
  double stretch = 1.0;  ///< Of times.
};

/// False for an empty cloud: an empty list of components would make it one without labels.
[[nodiscard]] bool is_semantic(const Scan& scan, const ScanToSend& how) noexcept;
/// A tessera_semantic_cloud or tessera_cloud. Fails with kUsage iff a sweep is stretched over more
/// than a message can hold.
Outcome<std::vector<std::byte>> cloud_message(Scan& scan, const ScanToSend& how);
[[nodiscard]] std::vector<std::byte> depth_message(const Scan& scan, const ScanToSend& how);
[[nodiscard]] std::vector<std::byte> label_message(const ScanImage& image, std::int64_t stamp_us,
                                                   std::int32_t camera);

}  // namespace tessera
