// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "node/start_counter.hpp"

#include <fcntl.h>
#include <sys/file.h>

#include <cerrno>
#include <charconv>
#include <filesystem>
#include <limits>
#include <span>
#include <system_error>

#include "posix/atomic_file.hpp"
#include "posix/input_file.hpp"
#include "posix/system_failure.hpp"

namespace tessera {

namespace {

constexpr std::size_t kMostBytes = 64;

/// Starts so far.
Outcome<std::uint32_t> read_count(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::exists(path, error) && !error) return std::uint32_t{0};
  const Outcome<std::string> text = read_text_file(path, kMostBytes);
  if (!text.ok()) return text.failure();
  std::uint32_t count = 0;
  const char* const end = text->data() + text->size();
  const auto [stopped, wrong] = std::from_chars(text->data(), end, count);
  if (wrong != std::errc{} || std::string_view(stopped, end) != "\n" || count == 0) {
    return Failure{path +
                   " holds no count of starts; write a number into it that is higher than all of "
                   "this robot's epochs that others may have"};
  }
  return count;
}

}  // namespace

Outcome<FileDescriptor> lock_robot(const std::string& folder, std::uint32_t robot) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    return Failure{"cannot make the folder " + folder + ": " + error.message() +
                   "; name another one"};
  }
  const std::string path = folder + "/robot_" + std::to_string(robot) + ".lock";
  constexpr ::mode_t kMode = 0644;
  FileDescriptor file(::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, kMode));
  if (!file.is_open()) return system_failure("open", path, errno, FailureKind::kUsage);
  if (::flock(file.get(), LOCK_EX | LOCK_NB) != 0) {
    if (errno != EWOULDBLOCK) return system_failure("lock", path, errno, FailureKind::kUsage);
    return Failure{"robot " + std::to_string(robot) + " is running already, with the state in " +
                   folder + "; end it, or give this one another number"};
  }
  return file;
}

Outcome<std::uint32_t> count_start(const std::string& folder, std::uint32_t robot) {
  const std::string path = folder + "/robot_" + std::to_string(robot) + ".starts";
  const Outcome<std::uint32_t> before = read_count(path);
  if (!before.ok()) return before.failure();
  if (*before == std::numeric_limits<std::uint32_t>::max()) {
    return Failure{path + " is at its end; give the robot another number", FailureKind::kFailure};
  }
  const std::uint32_t count = *before + 1;
  Outcome<AtomicFile> file = AtomicFile::open(path);
  if (!file.ok()) return file.failure();
  const std::string text = std::to_string(count) + "\n";
  file->write(std::as_bytes(std::span(text)));
  const Outcome<void> committed = file->commit();
  if (!committed.ok()) return committed.failure();
  return count;
}

}  // namespace tessera
