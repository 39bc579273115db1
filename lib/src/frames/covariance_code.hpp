// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The 72 bytes of a covariance, the same in links and in priors: about_a, three times 3 in steps of
// 2^-4 m; the lower triangular L with covariance = L L^T, 21 times 3, row after row, the first
// three rows in steps of 2^-14 m and the others in steps of 2^-20 rad.
#pragma once

#include "tessera/base/internal/byte_io.hpp"
#include "tessera/frames/frame_link.hpp"

namespace tessera {

inline constexpr std::size_t kCovarianceBytes = 3 * (3 + FrameCovariance::kValues);

/// False: it has no code, as encode_link says.
[[nodiscard]] bool write_covariance(ByteWriter& to, const FrameCovariance& covariance) noexcept;
/// False: not positive definite, or of a number that is never written.
[[nodiscard]] bool read_covariance(ByteReader& from, FrameCovariance& covariance) noexcept;

}  // namespace tessera
