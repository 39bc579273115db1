// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Recorded scans of any format, as measured, by their place in the recording; and their reading one
// at a time as input of the integrator.
#pragma once

#include <cstddef>
#include <memory>
#include <string>

#include "base/outcome.hpp"
#include "scans/dataset_classes.hpp"
#include "scans/registrar.hpp"
#include "scans/scan.hpp"
#include "scans/scan_motion.hpp"

namespace tessera {

class RecordedScans {
 public:
  virtual ~RecordedScans() = default;
  [[nodiscard]] virtual std::size_t num_scans() const noexcept = 0;
  /// Its number in the folder.
  [[nodiscard]] virtual int scan_number(std::size_t i) const = 0;
  /// Points that scan i has at most.
  [[nodiscard]] virtual std::size_t num_points(std::size_t i) const = 0;
  /// Of the largest scan.
  [[nodiscard]] virtual std::size_t max_points() const noexcept = 0;
  /// As recorded: may be not rigid or not finite.
  [[nodiscard]] virtual const Matrix34d& T_map_sensor(std::size_t i) const = 0;
  [[nodiscard]] virtual const DatasetClasses& classes() const noexcept = 0;
  /// Times of the scans, and poses in between; null if the recording has none or they were not
  /// asked for.
  [[nodiscard]] virtual const ScanMotion* motion() const noexcept { return nullptr; }
  /// True if scans are read with the times of their points.
  [[nodiscard]] virtual bool has_times() const noexcept { return false; }
  /// True if read() uses the heap for decoding files.
  [[nodiscard]] virtual bool decodes() const noexcept = 0;
  /// How a Registrar makes points of these scans; its limits are those of the largest scan.
  [[nodiscard]] virtual RegistrarConfig registration() const = 0;
  /// Reads scan i as it was measured, one at a time. Reserves memory for its points if
  /// needed.
  virtual Outcome<void> read(std::size_t i, Scan& into) const = 0;

 protected:
  RecordedScans() = default;
  RecordedScans(const RecordedScans&) = default;
  RecordedScans& operator=(const RecordedScans&) = default;
  RecordedScans(RecordedScans&&) = default;
  RecordedScans& operator=(RecordedScans&&) = default;
};

/// The failure of a scan that a Registrar refuses.
[[nodiscard]] Failure does_not_suit(const Scan& scan);

/// Reads recorded scans in any order and registers them.
class ScanReader {
 public:
  /// scans must outlive it. Fails as Registrar::make.
  static Outcome<ScanReader> make(const RecordedScans& scans);

  /// Scan i as input of the integrator, valid until the next call. Fails as RecordedScans::read,
  /// and with kUsage iff the scan cannot be registered. Uses the heap only if RecordedScans::read
  /// does or it fails.
  Outcome<ScanView> read(std::size_t i) { return read(i, scan_); }
  /// The same into the caller's memory, except for points of depth images.
  Outcome<ScanView> read(std::size_t i, Scan& into);

  /// The scan that was read last by read(i).
  [[nodiscard]] const Scan& scan() const noexcept { return scan_; }
  /// What was done to the scan that was read last.
  [[nodiscard]] const RegistrationRecord& registration() const noexcept {
    return registrar_->last();
  }

 private:
  ScanReader(const RecordedScans& scans, std::unique_ptr<Registrar> registrar, Scan scan);

  const RecordedScans* scans_;
  std::unique_ptr<Registrar> registrar_;
  Scan scan_;
};

}  // namespace tessera
