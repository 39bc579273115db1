// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Numbers as users type them, and as text for output.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace tessera {

/// The number as a user would type it.
std::string text_of(double value);

/// The number with nine significant digits, which tell any two floats apart.
std::string nine_digits(double value);

/// The number that a user typed for this float: its shortest decimal text, as a double.
double decimal_of(float value);

/// Bytes of "512M" and the like: a number alone, or with K, M, G, which are powers of 1024. Empty
/// if the text is invalid, negative, or over 10^15.
std::optional<std::size_t> parse_bytes(const std::string& text);

/// "1 scan", "2 scans".
std::string counted(std::uint64_t count, std::string_view singular);

}  // namespace tessera
