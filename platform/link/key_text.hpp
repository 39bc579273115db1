// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The text of key files: reads it with all checks, line by line, and writes lines. For key_file and
// key_maker; all others use these.
#pragma once

#include <fmt/core.h>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "base/outcome.hpp"
#include "link/key_file.hpp"

namespace tessera {

inline constexpr std::string_view kFleetKeyKind = "tessera-fleet-key";
inline constexpr std::string_view kMissionKind = "tessera-mission";
inline constexpr std::string_view kRobotSecretKind = "tessera-robot-secret";
inline constexpr std::string_view kRobotPublicKind = "tessera-robot-public";
inline constexpr std::size_t kMostKeyLineBytes = 256;  ///< Of written lines.

/// Text that is wiped on destruction.
struct SecretText {
  std::string bytes;
  explicit SecretText(std::string text) : bytes(std::move(text)) {}
  SecretText(SecretText&& other) noexcept : bytes(std::move(other.bytes)) {}
  SecretText& operator=(SecretText&&) = delete;
  SecretText(const SecretText&) = delete;
  SecretText& operator=(const SecretText&) = delete;
  ~SecretText();
};

/// One line with content.
struct KeyLine {
  std::string_view kind{};
  std::uint32_t robot = 0;                     ///< Of a robot's keys.
  std::array<unsigned char, kKeyBytes> key{};  ///< Except for a mission; wiped on destruction.
  std::string_view mission{};                  ///< Of a mission: its name.
  ~KeyLine();
};

[[nodiscard]] Failure bad_key(const std::string& path, const std::string& reason);

/// Reads the whole file. Fails as read_fleet_key() for secrets, and as read_public_keys() for
/// others.
Outcome<SecretText> read_key_text(const std::string& path, bool secret);

/// Cuts the next line off the text, without its end.
std::string_view take_key_line(std::string_view& text) noexcept;
/// True if the line has words and is not a comment.
[[nodiscard]] bool says_something(std::string_view line) noexcept;
/// Empty if the line is malformed.
std::optional<KeyLine> parse_key_line(std::string_view line);

/// Calls use(line) for each line with content, until it returns an objection: a text such as "is a
/// second key; keep one", or nullptr.
template <class Use>
Outcome<void> for_each_key(const std::string& path, std::string_view text, Use use) {
  // Some editors write this mark before UTF-8; it is not part of the text.
  if (constexpr std::string_view kMark = "\xef\xbb\xbf"; text.starts_with(kMark))
    text.remove_prefix(kMark.size());
  for (int number = 1; !text.empty(); ++number) {
    const std::string_view line = take_key_line(text);
    if (!says_something(line)) continue;
    const std::optional<KeyLine> key = parse_key_line(line);
    if (!key) {
      return bad_key(
          path,
          fmt::format("line {} is not a complete key of version 1; copy the file again", number));
    }
    const char* const objection = use(*key);
    if (objection != nullptr) return bad_key(path, fmt::format("line {} {}", number, objection));
  }
  return {};
}

/// Makes lines with their check and end. robot: for a robot's keys.
[[nodiscard]] std::string key_line_of(std::string_view kind, std::optional<std::uint32_t> robot,
                                      const std::array<unsigned char, kKeyBytes>& key);
[[nodiscard]] std::string mission_line_of(std::string_view name);

}  // namespace tessera
