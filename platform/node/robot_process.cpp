// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "node/robot_process.hpp"

#include <fmt/core.h>
#include <sys/stat.h>

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <system_error>

#include "base/system_failure.hpp"

namespace tessera {

namespace {

/// True if that process has the file open: /proc/locks has only the inode of a file, and the
/// process may have ended since.
bool has_open(pid_t process, const struct ::stat& file) {
  std::error_code error;
  const std::filesystem::path folder = fmt::format("/proc/{}/fd", process);
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    struct ::stat open {};
    if (::stat(entry.path().c_str(), &open) == 0 && open.st_dev == file.st_dev &&
        open.st_ino == file.st_ino)
      return true;
  }
  return false;
}

}  // namespace

Outcome<pid_t> find_robot_process(const std::string& folder, std::uint32_t robot) {
  const std::string path = fmt::format("{}/robot_{}.lock", folder, robot);
  struct ::stat file {};
  if (::stat(path.c_str(), &file) != 0)
    return system_failure("find", path, errno, FailureKind::kUsage);
  // "1: FLOCK  ADVISORY  WRITE 1234 08:01:131 0 EOF"
  std::ifstream locks("/proc/locks");
  std::string line;
  while (std::getline(locks, line)) {
    std::istringstream words(line);
    std::string number, kind, advice, access, place;
    pid_t process = 0;
    words >> number >> kind >> advice >> access >> process >> place;
    const std::size_t colon = place.rfind(':');
    if (!words || kind != "FLOCK" || colon == std::string::npos) continue;
    if (place.substr(colon + 1) == std::to_string(file.st_ino) && has_open(process, file))
      return process;
  }
  return Failure{fmt::format(
      "robot {} does not run with the state in {}, or runs as another user; start it, or use sudo",
      robot, folder)};
}

}  // namespace tessera
