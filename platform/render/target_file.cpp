// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "render/target_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>

namespace tessera {
namespace {

Failure cannot_write(const std::string& path, const std::string& reason, FailureKind kind) {
  return {"cannot write " + path + ": " + reason, kind};
}

}  // namespace

TargetFile::TargetFile(std::string path, std::string target, std::string temporary,
                       std::FILE* stream)
    : path_(std::move(path)),
      target_(std::move(target)),
      temporary_(std::move(temporary)),
      stream_(stream) {}

TargetFile::TargetFile(TargetFile&& other) noexcept
    : path_(std::move(other.path_)),
      target_(std::move(other.target_)),
      temporary_(std::exchange(other.temporary_, {})),
      stream_(std::exchange(other.stream_, nullptr)),
      error_(other.error_) {}

TargetFile& TargetFile::operator=(TargetFile&& other) noexcept {
  if (this == &other) return *this;
  discard();
  path_ = std::move(other.path_);
  target_ = std::move(other.target_);
  temporary_ = std::exchange(other.temporary_, {});
  stream_ = std::exchange(other.stream_, nullptr);
  error_ = other.error_;
  return *this;
}

TargetFile::~TargetFile() { discard(); }

Outcome<TargetFile> TargetFile::create(const std::string& path) {
  namespace fs = std::filesystem;
  if (path.empty()) return Failure{"cannot write: the output path is empty; name a file"};
  std::error_code status_error;
  const fs::file_status status = fs::status(path, status_error);
  if (fs::is_directory(status)) {
    return cannot_write(path, "it is a folder; name a file in it", FailureKind::kUsage);
  }
  // Renaming over /dev/null or a pipe would replace the device itself.
  if (fs::exists(status) && !fs::is_regular_file(status)) {
    return cannot_write(path, "it is not a regular file; choose another name", FailureKind::kUsage);
  }
  std::error_code link_error;
  const fs::path resolved = fs::canonical(path, link_error);
  const std::string target = link_error ? path : resolved.string();
  const std::string temporary = target + "." + std::to_string(::getpid()) + ".part";
  const int descriptor = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  std::FILE* stream = descriptor < 0 ? nullptr : ::fdopen(descriptor, "wb");
  if (stream == nullptr) {
    const int reason = errno;
    if (descriptor >= 0) ::close(descriptor);
    return cannot_write(
        path, std::string(std::strerror(reason)) + "; choose a folder that exists and is writable",
        FailureKind::kUsage);
  }
  return TargetFile(path, target, temporary, stream);
}

void TargetFile::write(const void* bytes, std::size_t count) {
  if (error_ != 0 || count == 0) return;
  errno = 0;
  if (std::fwrite(bytes, 1, count, stream_) != count) error_ = errno != 0 ? errno : EIO;
}

Outcome<void> TargetFile::commit() {
  errno = 0;
  if (error_ == 0 && (std::fflush(stream_) != 0 || std::ferror(stream_) != 0)) {
    error_ = errno != 0 ? errno : EIO;
  }
  // Without this, a power cut soon after the renaming could leave an empty file under the final
  // name.
  if (error_ == 0 && ::fsync(::fileno(stream_)) != 0 && errno != EINVAL) error_ = errno;
  if (std::fclose(std::exchange(stream_, nullptr)) != 0 && error_ == 0) error_ = errno;
  if (error_ == 0 && std::rename(temporary_.c_str(), target_.c_str()) != 0) error_ = errno;
  if (error_ != 0) {
    discard();
    return cannot_write(path_, std::string(std::strerror(error_)) + "; nothing was left there",
                        FailureKind::kFailure);
  }
  temporary_.clear();
  return {};
}

void TargetFile::discard() noexcept {
  if (stream_ != nullptr) std::fclose(std::exchange(stream_, nullptr));
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
  temporary_.clear();
}

}  // namespace tessera
