// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The part of the report of map about cameras, depth images and motion.
#pragma once

#include "base/json.hpp"
#include "scans/registrar.hpp"

namespace tessera {

/// Adds "deskew", "projection" and "depth" to the totals, if there was any.
void write_registration(const RegistrarReport& report, Json& totals);
/// Prints a line for each on stdout, and warnings on stderr.
void print_registration(const RegistrarReport& report);

/// Adds "deskew", "projection" and "depth" to the record of a scan, if there was any.
void write_registration(const RegistrationRecord& record, Json& scan);

}  // namespace tessera
