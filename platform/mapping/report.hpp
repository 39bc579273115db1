// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// JSON reports, written whole or not at all.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "posix/outcome.hpp"

namespace tessera {

/// Insertion order, so that a report reads as it was thought.
using Json = nlohmann::ordered_json;

/// Writes the report to path; does nothing if path is empty.
Outcome<void> write_report(const Json& report, const std::string& path);

/// Fails as write_report would for the place, without leaving anything there; to be asked before
/// long work.
Outcome<void> check_writable(const std::string& path);

/// Sixteen hexadecimal digits.
std::string hex64(std::uint64_t value);

}  // namespace tessera
