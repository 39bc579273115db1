// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "node/kept_maps.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <system_error>

#include "base/file_descriptor.hpp"
#include "base/system_failure.hpp"
#include "maps/stored_map.hpp"
#include "settings/map_options.hpp"

namespace tessera {

namespace {

namespace fs = std::filesystem;

constexpr int kMostNames = 10'000;

std::string epoch_text(std::uint32_t epoch) { return fmt::format("epoch-{}", epoch); }

/// number: 1 for the first, whose name does not have it.
std::string kept_name(const fs::path& path, const std::string& what, int number) {
  std::string name = path.stem().string() + "." + what;
  if (number != 1) name.append(".").append(std::to_string(number));
  return (path.parent_path() / name).string() + path.extension().string();
}

/// The first name that no file has. Empty: the file at path already has such a name.
Outcome<std::string> free_name(const std::string& path, const std::string& what) {
  std::error_code error;
  for (int number = 1; number <= kMostNames; ++number) {
    std::string name = kept_name(path, what, number);
    if (!fs::exists(fs::symlink_status(name, error))) return name;
    if (fs::equivalent(name, path, error)) return std::string();
  }
  return Failure{fmt::format("there are {} files like {}; move some of them", kMostNames,
                             kept_name(path, what, kMostNames)),
                 FailureKind::kFailure};
}

}  // namespace

Outcome<std::string> free_epoch_name(const std::string& path, std::uint32_t epoch) {
  return free_name(path, epoch_text(epoch));
}

Outcome<std::string> keep_earlier_map(const std::string& path) {
  std::error_code error;
  if (!fs::exists(path, error)) return std::string();
  // The file itself, not a symbolic link to it: a write replaces the file.
  const std::string file = fs::canonical(path, error).string();
  const Outcome<MapFileHeader> header = load_map_header(path);
  Outcome<std::string> name =
      free_name(file, header.ok() ? epoch_text(header->identity.epoch) : "earlier");
  if (!name.ok() || name->empty()) return name;
  if (::link(file.c_str(), name->c_str()) == 0) return name;
  const bool no_links = errno == EPERM || errno == EOPNOTSUPP || errno == EMLINK;
  if (no_links && ::rename(file.c_str(), name->c_str()) == 0) return name;
  return Failure{system_failure("keep as " + *name, path, errno, FailureKind::kUsage).message +
                 "; move it, or write [output] keep_maps = false if it may be overwritten"};
}

Outcome<std::string> keep_earlier_archive(const std::string& path) {
  const FileDescriptor file(::open(path.c_str(), O_RDWR | O_CLOEXEC));
  if (!file.is_open()) {
    if (errno == ENOENT) return std::string();
    return system_failure("write", path, errno, FailureKind::kUsage);
  }
  if (::flock(file.get(), LOCK_EX | LOCK_NB) != 0)
    return Failure{path + " is in use by another process; choose another " +
                   kMapSettings["--archive"]};
  Outcome<std::string> name = free_name(path, "earlier");
  if (!name.ok() || ::rename(path.c_str(), name->c_str()) == 0) return name;
  return system_failure("keep as " + *name, path, errno, FailureKind::kUsage);
}

}  // namespace tessera
