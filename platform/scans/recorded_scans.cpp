// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "scans/recorded_scans.hpp"

#include <utility>

namespace tessera {

Failure does_not_suit(const Scan& scan) {
  return {"scan " + std::to_string(scan.number) + " does not suit its camera"};
}

ScanReader::ScanReader(const RecordedScans& scans, std::unique_ptr<Registrar> registrar, Scan scan)
    : scans_(&scans), registrar_(std::move(registrar)), scan_(std::move(scan)) {}

Outcome<ScanReader> ScanReader::make(const RecordedScans& scans) {
  const RegistrarConfig config = scans.registration();
  Outcome<std::unique_ptr<Registrar>> registrar = Registrar::make(config);
  if (!registrar.ok()) return registrar.failure();
  return ScanReader(scans, std::move(*registrar), Scan(config.limits));
}

Outcome<ScanView> ScanReader::read(std::size_t i, Scan& into) {
  const Outcome<void> done = scans_->read(i, into);
  if (!done.ok()) return done.failure();
  ScanView view;
  if (registrar_->view(into, view)) return view;
  return does_not_suit(into);
}

}  // namespace tessera
