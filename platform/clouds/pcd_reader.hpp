// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Point clouds in PCD files: ascii, binary (little-endian) and binary_compressed.
#pragma once

#include "clouds/cloud.hpp"
#include "posix/outcome.hpp"

namespace tessera {

/// From the header alone. Fails as parse_pcd_header().
Outcome<CloudSummary> inspect_pcd(const CloudBytes& head, std::uint64_t file_bytes);

/// Reads all points of a whole file. In an organised cloud those of which x, y and z are NaN are
/// left out, as nothing came back there. Bytes after the last point that are too few for another
/// are passed over. Heap: what compressed points become (88 times their bytes at most), 24 bytes a
/// point, of which the file has at least 3 bytes or compressed ones, and 64 bytes for each of the
/// header's; of compressed points PcdHeader::kMostUnpackedBytes in all at most. Fails with kUsage,
/// naming the file and the remedy, iff inspect_pcd() does, there are more points than the header
/// says, a row is malformed, compressed points are damaged, a label is no whole number, or
/// ByteOrderVote::check() fails.
Outcome<void> read_pcd(const CloudBytes& file, Cloud& cloud);

}  // namespace tessera
