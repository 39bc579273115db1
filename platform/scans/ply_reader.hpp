// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Point clouds in PLY files: ascii and binary of either byte order.
#pragma once

#include "base/outcome.hpp"
#include "scans/cloud.hpp"

namespace tessera {

/// Summary of the header. Fails as parse_ply_header().
Outcome<CloudSummary> inspect_ply(const CloudBytes& head, std::uint64_t file_bytes);

/// Reads all vertices of a whole file; ignores other elements. The memory is at most 10
/// times the file's size and some KiB. Fails with kUsage, naming the file and the remedy, iff
/// inspect_ply() does, the file ends too early, a list is longer than the file, the file continues
/// after the last element, a row is malformed, a label is not a whole number, or
/// ByteOrderVote::check() fails.
Outcome<void> read_ply(const CloudBytes& file, Cloud& cloud);

}  // namespace tessera
