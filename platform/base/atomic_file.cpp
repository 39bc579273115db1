// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "base/atomic_file.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <optional>
#include <system_error>
#include <utility>

#include "base/new_file.hpp"
#include "base/system_failure.hpp"

namespace tessera {
namespace {

constexpr std::size_t kBufferBytes = std::size_t{1} << 16U;
constexpr unsigned kNewFileMode = 0666;
constexpr int kNameAttempts = 1000;
constexpr const char* kOwnFiles = "/proc/self/fd";

Failure refusal(const std::string& path, const char* reason) {
  return {"cannot write " + path + ": " + reason, FailureKind::kUsage};
}

std::string folder_of(const std::string& path) {
  const std::string folder = std::filesystem::path(path).parent_path().string();
  return folder.empty() ? "." : folder;
}

/// Why an existing file must not be replaced; nullptr if it may be.
const char* objection_to_replacing(const std::string& target, const struct stat& existing) {
  if (S_ISDIR(existing.st_mode)) return "it is a folder; name a file in it";
  // Renaming over /dev/null or a pipe would replace the device itself.
  if (!S_ISREG(existing.st_mode)) return "it is not a regular file; choose another name";
  // Renaming needs permission of the folder, not of the file, so write protection is checked here.
  if (::access(target.c_str(), W_OK) != 0) {
    return "it is write-protected; make it writable or choose another name";
  }
  return nullptr;
}

}  // namespace

AtomicFile& AtomicFile::operator=(AtomicFile&& other) noexcept {
  if (this == &other) return *this;
  discard();
  swap(other);
  return *this;
}

AtomicFile::~AtomicFile() { discard(); }

Outcome<AtomicFile> AtomicFile::open(const std::string& path) {
  if (path.empty()) return Failure{"cannot write: the output path is empty; name a file"};
  AtomicFile file;
  file.path_ = path;
  std::error_code missing;
  const std::filesystem::path resolved = std::filesystem::canonical(path, missing);
  file.target_ = missing ? path : resolved.string();

  unsigned mode = 0;
  struct stat existing {};
  if (::stat(file.target_.c_str(), &existing) == 0) {
    const char* objection = objection_to_replacing(file.target_, existing);
    if (objection != nullptr) return refusal(path, objection);
    mode = existing.st_mode & 07777U;
  }
  TESSERA_TRY(file.create_temporary(mode));
  file.buffer_ = std::make_unique<std::byte[]>(kBufferBytes);
  return file;
}

std::string AtomicFile::temporary_name(int attempt) const {
  return fmt::format("{}.{}-{}.part", target_, ::getpid(), attempt);
}

Outcome<void> AtomicFile::create_temporary(unsigned mode) {
  if (::access(kOwnFiles, X_OK) == 0) {  // This folder is needed to give the file a name later.
    const std::string folder = folder_of(target_);
    file_ = FileDescriptor(::open(folder.c_str(), O_TMPFILE | O_WRONLY | O_CLOEXEC, kNewFileMode));
  }
  // If the file system has no files without names. Exclusive creation, so that two processes (or a
  // leftover of a killed one) never share a temporary.
  for (int attempt = 0; !file_.is_open() && attempt < kNameAttempts; ++attempt) {
    std::string name = temporary_name(attempt);
    file_ =
        FileDescriptor(::open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, kNewFileMode));
    if (file_.is_open())
      temporary_ = std::move(name);
    else if (errno != EEXIST)
      break;
  }
  if (file_.is_open()) {
    // A replaced file keeps its permissions; a failure to set them does not lose the data.
    if (mode != 0) static_cast<void>(!::fchmod(file_.get(), mode));
    return {};
  }
  const int reason = errno;
  if (reason == ENOENT) {
    return refusal(path_, "its folder does not exist; create it or choose another");
  }
  return system_failure("write", path_, reason, FailureKind::kUsage);
}

/// Gives the temporary a name, if it has none, for the moment before it is renamed: linking cannot
/// replace a file. Returns errno.
int AtomicFile::name_temporary() {
  if (!temporary_.empty()) return 0;
  const std::string self = fmt::format("{}/{}", kOwnFiles, file_.get());
  for (int attempt = 0; attempt < kNameAttempts; ++attempt) {
    std::string name = temporary_name(attempt);
    if (::linkat(AT_FDCWD, self.c_str(), AT_FDCWD, name.c_str(), AT_SYMLINK_FOLLOW) == 0) {
      temporary_ = std::move(name);
      return 0;
    }
    if (errno != EEXIST) return errno;
  }
  return EEXIST;
}

bool AtomicFile::write(std::span<const std::byte> bytes) noexcept {
  if (error_ != 0 || !file_.is_open()) return false;
  if (bytes.size() > kBufferBytes - buffered_bytes_ && !flush()) return false;
  if (bytes.size() >= kBufferBytes) return write_through(bytes);
  if (!bytes.empty()) std::memcpy(buffer_.get() + buffered_bytes_, bytes.data(), bytes.size());
  buffered_bytes_ += bytes.size();
  return true;
}

bool AtomicFile::write_through(std::span<const std::byte> bytes) noexcept {
  while (!bytes.empty()) {
    const ssize_t count = ::write(file_.get(), bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) {
      error_ = count < 0 ? errno : EIO;
      return false;
    }
    bytes = bytes.subspan(static_cast<std::size_t>(count));
  }
  return true;
}

bool AtomicFile::flush() noexcept {
  const std::size_t count = std::exchange(buffered_bytes_, 0);
  return write_through({buffer_.get(), count});
}

Outcome<void> AtomicFile::commit() {
  if (error_ == 0 && !file_.is_open()) {
    return Failure{
        "cannot write " + path_ + ": it is already complete; open it again to replace it",
        FailureKind::kFailure};
  }
  if (error_ == 0) static_cast<void>(flush());
  // Without this, a power cut soon after the renaming could leave an empty file under the final
  // name. EINVAL: a file system without syncing.
  if (error_ == 0 && ::fsync(file_.get()) != 0 && errno != EINVAL) error_ = errno;
  if (error_ == 0) error_ = name_temporary();
  if (!file_.close() && error_ == 0) error_ = errno;
  if (error_ == 0 && std::rename(temporary_.c_str(), target_.c_str()) != 0) error_ = errno;
  if (error_ != 0) {
    discard();
    return system_failure("write", path_, error_, FailureKind::kFailure);
  }
  temporary_.clear();
  sync_folder_of(target_);
  return {};
}

void AtomicFile::discard() noexcept {
  static_cast<void>(file_.close());
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
  temporary_.clear();
}

void AtomicFile::swap(AtomicFile& other) noexcept {
  std::swap(path_, other.path_);
  std::swap(target_, other.target_);
  std::swap(temporary_, other.temporary_);
  std::swap(file_, other.file_);
  std::swap(buffer_, other.buffer_);
  std::swap(buffered_bytes_, other.buffered_bytes_);
  std::swap(error_, other.error_);
}

}  // namespace tessera
