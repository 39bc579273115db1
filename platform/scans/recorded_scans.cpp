// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "scans/recorded_scans.hpp"

#include <fmt/core.h>

#include <utility>

namespace tessera {

Failure does_not_suit(const Scan& scan) {
  return {fmt::format("scan {} does not suit its camera", scan.number)};
}

ScanReader::ScanReader(const RecordedScans& scans, std::unique_ptr<Registrar> registrar, Scan scan)
    : scans_(&scans), registrar_(std::move(registrar)), scan_(std::move(scan)) {}

Outcome<ScanReader> ScanReader::make(const RecordedScans& scans) {
  const RegistrarConfig config = scans.registration();
  TESSERA_TRY_ASSIGN(std::unique_ptr<Registrar> registrar, Registrar::make(config));
  return ScanReader(scans, std::move(registrar), Scan(config.limits));
}

Outcome<ScanView> ScanReader::read(std::size_t i, Scan& into) {
  TESSERA_TRY(scans_->read(i, into));
  ScanView view;
  if (registrar_->view(into, view)) return view;
  return does_not_suit(into);
}

}  // namespace tessera
