// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// JSON reports, written atomically.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "base/outcome.hpp"

namespace tessera {

/// Keeps the insertion order, for readable reports.
using Json = nlohmann::ordered_json;

/// Writes the report to path; does nothing if path is empty.
Outcome<void> write_report(const Json& report, const std::string& path);

/// Fails as write_report would for this path, without leaving anything there; call it before long
/// work.
Outcome<void> check_writable(const std::string& path);

/// Sixteen hexadecimal digits.
std::string hex64(std::uint64_t value);

}  // namespace tessera
