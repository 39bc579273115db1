// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What must hold of every scan, whatever its returns and whatever is scarce.
#pragma once

#include <optional>
#include <string>

#include "laws/scan_cases.hpp"
#include "tessera/base/internal/digest.hpp"

namespace tessera::oracle {

/// How often cases met what they are for.
struct CaseTally {
  int left_out = 0;      ///< Scans of which something did not fit.
  int cut = 0;           ///< Scans of which a deadline left something unwritten.
  int freed_voxels = 0;  ///< Voxels that passed the test of being crossed.
  int kept_points = 0;
};

/// Integrates a case and holds it against the laws; the first that is broken, in words. Adds the
/// map to the digest.
[[nodiscard]] std::optional<std::string> broken_law(const ScanCase& scan_case, Digest& digest,
                                                    CaseTally& tally);

}  // namespace tessera::oracle
