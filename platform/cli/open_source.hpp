// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Opens the scans that a command reads.
#pragma once

#include <memory>

#include "base/outcome.hpp"
#include "scans/open_scans.hpp"

namespace tessera {

/// open_scans() after check_source(), with its warnings on stderr.
Outcome<std::unique_ptr<RecordedScans>> open_source(const SourceOptions& options,
                                                    const ExtraContent& extra = {});

}  // namespace tessera
