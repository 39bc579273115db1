// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "scans/lzf.hpp"

#include <lzf.h>

#include <limits>

namespace tessera {

bool decompress_lzf(std::string_view compressed, std::span<char> out) {
  constexpr std::size_t kMost = std::numeric_limits<unsigned>::max();
  if (compressed.size() > kMost || out.size() > kMost) return false;
  if (compressed.empty() || out.empty()) return compressed.empty() && out.empty();
  const unsigned written =
      ::lzf_decompress(compressed.data(), static_cast<unsigned>(compressed.size()), out.data(),
                       static_cast<unsigned>(out.size()));
  return written == out.size();
}

}  // namespace tessera
