// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/open_source.hpp"

#include "cli/command.hpp"

namespace tessera {

Outcome<std::unique_ptr<RecordedScans>> open_source(const SourceOptions& options,
                                                    const ExtraContent& extra) {
  TESSERA_TRY_ASSIGN(OpenedScans opened, open_scans(options, extra));
  for (const Message& warning : opened.warnings) warn(warning);
  return std::move(opened.scans);
}

}  // namespace tessera
