// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The files of the page, embedded in the program.
#pragma once

#include <cstddef>
#include <span>
#include <string_view>

namespace tessera {

struct PageFile {
  std::string_view name;  ///< "index.html".
  const char* type;
  std::span<const std::byte> content;
};

/// All files, by name.
std::span<const PageFile> page_files() noexcept;

}  // namespace tessera
