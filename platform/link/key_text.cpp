// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "link/key_text.hpp"

#include <fcntl.h>
#include <sodium.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <span>

#include "base/file_descriptor.hpp"
#include "base/system_failure.hpp"
#include "link/mission.hpp"
#include "tessera/base/internal/crc32.hpp"

namespace tessera {
namespace {

constexpr std::size_t kMaxFileBytes = std::size_t{1} << 16U;
constexpr unsigned kOthers = 077;
constexpr unsigned kOthersWrite = 022;
constexpr const char* kBlanks = " \t\r";

std::optional<Failure> objection(const std::string& path, const struct stat& status, bool secret) {
  if (!S_ISREG(status.st_mode)) return bad_key(path, "it is not a regular file; name one");
  if (secret && status.st_uid != ::geteuid()) {
    return bad_key(path, "it belongs to another user; chown it to the user of this process");
  }
  if (secret && (status.st_mode & kOthers) != 0)
    return bad_key(path, "others than its owner may use it; chmod 600 " + path);
  if ((status.st_mode & kOthersWrite) != 0)
    return bad_key(path, "others than its owner may change it; chmod 644 " + path);
  if (static_cast<std::uint64_t>(status.st_size) > kMaxFileBytes)
    return bad_key(path, "it is over 64 KiB; name a key file");
  return std::nullopt;
}

/// Cuts off and returns the next word.
std::string_view take_word(std::string_view& line) {
  line.remove_prefix(std::min(line.find_first_not_of(kBlanks), line.size()));
  const std::string_view word = line.substr(0, line.find_first_of(kBlanks));
  line.remove_prefix(word.size());
  return word;
}

std::string check_of(std::string_view text) {
  char digits[9] = {};
  std::snprintf(digits, sizeof digits, "%08x", crc32c(std::as_bytes(std::span(text))));
  return digits;
}

bool read_hex(std::string_view hex, std::array<unsigned char, kKeyBytes>& key) {
  std::size_t bytes = 0;
  return hex.size() == 2 * kKeyBytes &&
         ::sodium_hex2bin(key.data(), key.size(), hex.data(), hex.size(), nullptr, &bytes,
                          nullptr) == 0 &&
         bytes == kKeyBytes;
}

/// After kind and version: the name as it is written, then the check.
std::optional<KeyLine> parse_mission(std::string_view rest) {
  rest.remove_prefix(std::min(rest.find_first_not_of(kBlanks), rest.size()));
  rest = rest.substr(0, rest.find_last_not_of(kBlanks) + 1);
  const std::size_t space = rest.rfind(' ');
  if (space == std::string_view::npos) return std::nullopt;
  KeyLine found;
  found.kind = kMissionKind;
  found.mission = rest.substr(0, space);
  const std::string text = std::string(kMissionKind) + " 1 " + std::string(found.mission);
  if (rest.substr(space + 1) != check_of(text) || !Mission::make(found.mission).ok())
    return std::nullopt;
  return found;
}

}  // namespace

SecretText::~SecretText() { ::sodium_memzero(bytes.data(), bytes.size()); }

KeyLine::~KeyLine() { ::sodium_memzero(key.data(), key.size()); }

Failure bad_key(const std::string& path, const std::string& reason) {
  return {"cannot use the key file " + path + ": " + reason};
}

Outcome<SecretText> read_key_text(const std::string& path, bool secret) {
  // Changing the target of a link would replace the key.
  const int no_links = secret ? O_NOFOLLOW : 0;
  const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | no_links));
  struct stat status {};
  if (!file.is_open() && errno == ELOOP)
    return bad_key(path, "it is a symbolic link; name the file itself");
  if (!file.is_open() || ::fstat(file.get(), &status) != 0)
    return system_failure("read", path, errno, FailureKind::kUsage);
  const std::optional<Failure> refused = objection(path, status, secret);
  if (refused) return *refused;
  SecretText text(std::string(kMaxFileBytes, '\0'));
  std::size_t filled = 0;
  while (filled < kMaxFileBytes) {
    const ssize_t count = ::read(file.get(), text.bytes.data() + filled, kMaxFileBytes - filled);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return system_failure("read", path, errno, FailureKind::kUsage);
    if (count == 0) break;
    filled += static_cast<std::size_t>(count);
  }
  text.bytes.resize(filled);
  return text;
}

std::string_view take_key_line(std::string_view& text) noexcept {
  const std::string_view line = text.substr(0, text.find('\n'));
  text.remove_prefix(std::min(line.size() + 1, text.size()));
  return line;
}

bool says_something(std::string_view line) noexcept {
  return line.find_first_not_of(kBlanks) != std::string_view::npos && !line.starts_with('#');
}

std::optional<KeyLine> parse_key_line(std::string_view line) {
  KeyLine found;
  std::string_view rest = line;
  found.kind = take_word(rest);
  const bool of_robot = found.kind == kRobotSecretKind || found.kind == kRobotPublicKind;
  if (!of_robot && found.kind != kFleetKeyKind && found.kind != kMissionKind) return std::nullopt;
  if (take_word(rest) != "1") return std::nullopt;
  if (found.kind == kMissionKind) return parse_mission(rest);
  std::string text;
  text.reserve(line.size());
  text.append(found.kind).append(" 1");
  if (of_robot) {
    const std::string_view robot = take_word(rest);
    const auto [end, error] =
        std::from_chars(robot.data(), robot.data() + robot.size(), found.robot);
    if (error != std::errc{} || end != robot.data() + robot.size()) return std::nullopt;
    text.append(" ").append(robot);
  }
  const std::string_view hex = take_word(rest);
  text.append(" ").append(hex);
  const bool fits = take_word(rest) == check_of(text) && take_word(rest).empty();
  ::sodium_memzero(text.data(), text.size());
  if (!fits || !read_hex(hex, found.key)) return std::nullopt;
  return found;
}

std::string key_line_of(std::string_view kind, std::optional<std::uint32_t> robot,
                        const std::array<unsigned char, kKeyBytes>& key) {
  char hex[2 * kKeyBytes + 1] = {};
  ::sodium_bin2hex(hex, sizeof hex, key.data(), key.size());
  std::string line;
  line.reserve(kMostKeyLineBytes);  // Growing would leave copies that are not wiped.
  line.append(kind).append(" 1 ");
  if (robot) line.append(std::to_string(*robot)).append(" ");
  line.append(hex);
  const std::string check = check_of(line);
  line.append(" ").append(check).append("\n");
  ::sodium_memzero(hex, sizeof hex);
  return line;
}

std::string mission_line_of(std::string_view name) {
  const std::string text = std::string(kMissionKind) + " 1 " + std::string(name);
  return text + " " + check_of(text) + "\n";
}

}  // namespace tessera
