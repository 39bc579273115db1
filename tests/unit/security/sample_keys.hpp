// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Keys that everybody knows, for tests; bytes in words; and a folder that goes when the test ends.
#pragma once

#include <sys/stat.h>

#include <cstddef>
#include <cstdio>
#include <span>
#include <string>

#include "link/key_file.hpp"
#include "link/mission.hpp"
#include "support/temporary_folder.hpp"

namespace tessera {

/// Bytes 0 to 31.
inline constexpr const char* kFleetLine =
    "tessera-fleet-key 1 000102030405060708090a0b0c0d0e0f101112131415161718191a1b1c1d1e1f "
    "5d6db9c8\n";
/// Robot 7 has the first key of RFC 8032, section 7.1.
inline constexpr const char* kSecretLine =
    "tessera-robot-secret 1 7 9d61b19deffd5a60ba844af492ec2cc44449c5697b326919703bac031cae7f60 "
    "548ff309\n";
inline constexpr const char* kPublicLine =
    "tessera-robot-public 1 7 d75a980182b10ab7d54bfed3c964073a0ee172f3daa62325af021a68f707511a "
    "dd5953e0\n";

inline constexpr const char* kMissionLine = "tessera-mission 1 harbour 7 e13cadf1\n";

inline Mission sample_mission(const char* name = "harbour 7") {
  return std::move(*Mission::make(name));
}

inline std::string hex_of(std::span<const std::byte> bytes) {
  std::string text;
  for (const std::byte b : bytes) {
    char digits[3];
    std::snprintf(digits, sizeof digits, "%02x", std::to_integer<unsigned>(b));
    text += digits;
  }
  return text;
}

/// A temporary folder of files with permissions.
class KeyFolder {
 public:
  [[nodiscard]] std::string path() const { return folder_.path().string(); }
  [[nodiscard]] std::string file(const std::string& name) const { return folder_.file(name); }
  /// The path of a file with that content and those permissions.
  [[nodiscard]] std::string write(const std::string& name, const std::string& text,
                                  mode_t mode = 0600) const {
    folder_.write(name, text);
    ::chmod(file(name).c_str(), mode);
    return file(name);
  }

 private:
  test::TemporaryFolder folder_;
};

}  // namespace tessera
