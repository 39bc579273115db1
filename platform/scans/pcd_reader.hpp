// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Point clouds in PCD files: ascii, binary (little-endian) and binary_compressed.
#pragma once

#include "base/outcome.hpp"
#include "scans/cloud.hpp"

namespace tessera {

/// Summary of the header. Fails as parse_pcd_header().
Outcome<CloudSummary> inspect_pcd(const CloudBytes& head, std::uint64_t file_bytes);

/// Reads all points of a whole file. In an organised cloud points whose x, y and z are NaN are
/// left out, as they have no return. Ignores bytes after the last point that are too few for
/// another. Heap: the unpacked points (at most 88 times their compressed bytes), 24 bytes for each
/// point, of which the file has at least 3 bytes or compressed ones, and 64 bytes for each byte of
/// the header; for compressed points at most PcdHeader::kMostUnpackedBytes in all. Fails with
/// kUsage, naming the file and the remedy, iff inspect_pcd() does, there are more points than the
/// header says, a row is malformed, compressed points are damaged, a label is not a whole number,
/// or ByteOrderVote::check() fails.
Outcome<void> read_pcd(const CloudBytes& file, Cloud& cloud);

}  // namespace tessera
