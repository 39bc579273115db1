// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "security/key_file.hpp"

#include <fcntl.h>
#include <sodium.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <optional>

#include "posix/file_descriptor.hpp"
#include "posix/new_file.hpp"
#include "posix/system_failure.hpp"
#include "tessera/base/crc32.hpp"

namespace tessera {
namespace {

constexpr std::string_view kFleet = "tessera-fleet-key";
constexpr std::string_view kSecret = "tessera-robot-secret";
constexpr std::string_view kPublic = "tessera-robot-public";
constexpr std::size_t kMaxLineBytes = 256;  ///< Of those that are written.
constexpr std::size_t kMaxFileBytes = std::size_t{1} << 16U;
constexpr unsigned kOthers = 077;
constexpr unsigned kOthersWrite = 022;

Failure bad_key(const std::string& path, const std::string& reason) {
  return {"cannot use the key file " + path + ": " + reason};
}

/// The text of a file, wiped when it goes.
struct Text {
  std::string bytes;
  explicit Text(std::string text) : bytes(std::move(text)) {}
  Text(Text&& other) noexcept : bytes(std::move(other.bytes)) {}
  Text& operator=(Text&&) = delete;
  Text(const Text&) = delete;
  Text& operator=(const Text&) = delete;
  ~Text() { ::sodium_memzero(bytes.data(), bytes.size()); }
};

std::optional<Failure> objection(const std::string& path, const struct stat& status, bool secret) {
  if (!S_ISREG(status.st_mode)) return bad_key(path, "it is no regular file; name one");
  if (secret && status.st_uid != ::geteuid()) {
    return bad_key(path, "it belongs to another user; chown it to the one who runs this");
  }
  if (secret && (status.st_mode & kOthers) != 0)
    return bad_key(path, "others than its owner may use it; chmod 600 " + path);
  if ((status.st_mode & kOthersWrite) != 0)
    return bad_key(path, "others than its owner may change it; chmod 644 " + path);
  if (static_cast<std::uint64_t>(status.st_size) > kMaxFileBytes)
    return bad_key(path, "it is over 64 KiB; that is no key file");
  return std::nullopt;
}

Outcome<Text> read_key_text(const std::string& path, bool secret) {
  // Whoever can change where a link leads could exchange the key.
  const int no_links = secret ? O_NOFOLLOW : 0;
  const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | no_links));
  struct stat status {};
  if (!file.is_open() && errno == ELOOP)
    return bad_key(path, "it is a symbolic link; name the file itself");
  if (!file.is_open() || ::fstat(file.get(), &status) != 0)
    return system_failure("read", path, errno, FailureKind::kUsage);
  const std::optional<Failure> refused = objection(path, status, secret);
  if (refused) return *refused;
  Text text(std::string(kMaxFileBytes, '\0'));
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

/// Cuts off and gives the next word.
std::string_view take_word(std::string_view& line) {
  line.remove_prefix(std::min(line.find_first_not_of(" \t\r"), line.size()));
  const std::string_view word = line.substr(0, line.find_first_of(" \t\r"));
  line.remove_prefix(word.size());
  return word;
}

std::string check_of(std::string_view text) {
  char digits[9] = {};
  std::snprintf(digits, sizeof digits, "%08x", crc32c(std::as_bytes(std::span(text))));
  return digits;
}

struct KeyLine {
  std::string_view kind{};
  std::uint32_t robot = 0;
  std::array<unsigned char, kKeyBytes> key{};
  ~KeyLine() { ::sodium_memzero(key.data(), key.size()); }
};

bool read_hex(std::string_view hex, std::array<unsigned char, kKeyBytes>& key) {
  std::size_t bytes = 0;
  return hex.size() == 2 * kKeyBytes &&
         ::sodium_hex2bin(key.data(), key.size(), hex.data(), hex.size(), nullptr, &bytes,
                          nullptr) == 0 &&
         bytes == kKeyBytes;
}

/// Nothing if the line is malformed.
std::optional<KeyLine> parse_line(std::string_view line) {
  KeyLine found;
  std::string_view rest = line;
  found.kind = take_word(rest);
  const bool of_robot = found.kind == kSecret || found.kind == kPublic;
  if (!of_robot && found.kind != kFleet) return std::nullopt;
  if (take_word(rest) != "1") return std::nullopt;
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

/// Calls use(line) for each line that says something, until that gives a failure.
template <class Use>
Outcome<void> for_each_key(const std::string& path, std::string_view text, Use use) {
  // What some editors put before UTF-8 is none of the text.
  if (constexpr std::string_view kMark = "\xef\xbb\xbf"; text.starts_with(kMark))
    text.remove_prefix(kMark.size());
  for (int number = 1; !text.empty(); ++number) {
    std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(line.size() + 1, text.size()));
    std::string_view first = line;
    if (take_word(first).empty() || line.starts_with('#')) continue;
    const std::optional<KeyLine> key = parse_line(line);
    if (!key) {
      return bad_key(path, "line " + std::to_string(number) +
                               " is no whole key of version 1; copy the file again");
    }
    const char* const objection = use(*key);
    if (objection != nullptr) {
      return bad_key(path, "line " + std::to_string(number) + " " + objection);
    }
  }
  return {};
}

/// The one key of a file of that kind.
Outcome<RobotSecret> read_secret(const std::string& path, std::string_view kind,
                                 const char* command) {
  const Outcome<Text> text = read_key_text(path, true);
  if (!text.ok()) return text.failure();
  RobotSecret secret;
  bool found = false;
  const Outcome<void> read =
      for_each_key(path, text->bytes, [&](const KeyLine& line) -> const char* {
        if (line.kind != kind) return "is a key of another kind; name the right file";
        if (found) return "is a second key; keep one";
        found = true;
        secret.robot = line.robot;
        secret.seed.bytes() = line.key;
        return nullptr;
      });
  if (!read.ok()) return read.failure();
  if (!found) return bad_key(path, std::string("it holds no key; make one with ") + command);
  return secret;
}

std::string line_of(std::string_view kind, const std::uint32_t* robot,
                    const std::array<unsigned char, kKeyBytes>& key) {
  char hex[2 * kKeyBytes + 1] = {};
  ::sodium_bin2hex(hex, sizeof hex, key.data(), key.size());
  std::string line;
  line.reserve(kMaxLineBytes);  // Growing would leave copies behind that nobody wipes.
  line.append(kind).append(" 1 ");
  if (robot != nullptr) line.append(std::to_string(*robot)).append(" ");
  line.append(hex);
  const std::string check = check_of(line);
  line.append(" ").append(check).append("\n");
  ::sodium_memzero(hex, sizeof hex);
  return line;
}

Outcome<void> write_key(const std::string& path, const char* comment, const std::string& line,
                        unsigned mode) {
  Text text{std::string()};
  text.bytes.reserve(kMaxLineBytes + line.size());
  text.bytes.append("# ").append(comment).append("\n").append(line);
  return write_new_file(path, std::as_bytes(std::span(text.bytes)), mode);
}

}  // namespace

SecretKey::SecretKey(SecretKey&& other) noexcept : bytes_(other.bytes_) {
  ::sodium_memzero(other.bytes_.data(), other.bytes_.size());
}

SecretKey& SecretKey::operator=(SecretKey&& other) noexcept {
  if (this == &other) return *this;
  bytes_ = other.bytes_;
  ::sodium_memzero(other.bytes_.data(), other.bytes_.size());
  return *this;
}

SecretKey::~SecretKey() { ::sodium_memzero(bytes_.data(), bytes_.size()); }

Outcome<SecretKey> read_fleet_key(const std::string& path) {
  Outcome<RobotSecret> secret = read_secret(path, kFleet, "tessera key new --fleet FILE");
  if (!secret.ok()) return secret.failure();
  return std::move(secret->seed);
}

Outcome<RobotSecret> read_robot_secret(const std::string& path) {
  return read_secret(path, kSecret, "tessera key new --robot ID --dir DIR");
}

Outcome<std::vector<RobotPublic>> read_public_keys(const std::string& path) {
  const Outcome<Text> text = read_key_text(path, false);
  if (!text.ok()) return text.failure();
  std::vector<RobotPublic> keys;
  const Outcome<void> read =
      for_each_key(path, text->bytes, [&](const KeyLine& line) -> const char* {
        if (line.kind != kPublic) return "is no public key; keep secrets out of this file";
        for (const RobotPublic& other : keys) {
          if (other.robot == line.robot) return "is a second key of that robot; keep one";
        }
        keys.push_back({line.robot, line.key});
        return nullptr;
      });
  if (!read.ok()) return read.failure();
  if (keys.empty()) return bad_key(path, "it holds no key; put the robots' .pub files together");
  std::sort(keys.begin(), keys.end(),
            [](const RobotPublic& a, const RobotPublic& b) { return a.robot < b.robot; });
  return keys;
}

Outcome<void> make_fleet_key(const std::string& path) {
  if (::sodium_init() < 0) return Failure{"libsodium does not start", FailureKind::kFailure};
  SecretKey key;
  ::crypto_kdf_keygen(key.bytes().data());
  const Text line(line_of(kFleet, nullptr, key.bytes()));
  return write_key(path, "Secret: whoever has it speaks for the fleet. The same on every robot.",
                   line.bytes, 0600);
}

Outcome<void> make_robot_key(std::uint32_t robot, const std::string& folder) {
  if (::sodium_init() < 0) return Failure{"libsodium does not start", FailureKind::kFailure};
  SecretKey seed;
  ::randombytes_buf(seed.bytes().data(), kKeyBytes);
  RobotPublic open{robot, {}};
  std::array<unsigned char, crypto_sign_SECRETKEYBYTES> expanded{};
  ::crypto_sign_seed_keypair(open.key.data(), expanded.data(), seed.bytes().data());
  ::sodium_memzero(expanded.data(), expanded.size());
  const std::string stem = folder + "/robot_" + std::to_string(robot);
  const Outcome<void> shown = write_key(
      stem + ".pub", "Public: the fleet's file of public keys is all robots' lines together.",
      line_of(kPublic, &robot, open.key), 0644);
  if (!shown.ok()) return shown.failure();
  const Text line(line_of(kSecret, &robot, seed.bytes()));
  Outcome<void> kept = write_key(stem + ".key", "Secret: for this robot alone.", line.bytes, 0600);
  if (!kept.ok()) ::unlink((stem + ".pub").c_str());
  return kept;
}

}  // namespace tessera
