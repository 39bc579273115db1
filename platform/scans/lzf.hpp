// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// LZF, as in compressed PCD files, by liblzf.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace tessera {

/// Most bytes that this number of compressed ones can become. A file that claims more is invalid,
/// so nothing need be allocated for it.
[[nodiscard]] constexpr std::uint64_t lzf_most_bytes(std::uint64_t compressed_bytes) noexcept {
  // Three bytes stand for up to 264 of those before them; two are enough for 8.
  return compressed_bytes * 88 + 264;
}

/// False iff compressed is damaged, or does not become exactly out.size() bytes. Writes only to
/// out.
[[nodiscard]] bool decompress_lzf(std::string_view compressed, std::span<char> out);

}  // namespace tessera
