// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The vocabulary of expected failures. Each function's docstring lists which of these it can
// return.
#pragma once

#include <cstdint>
#include <utility>

#include "tessera/base/assert.hpp"

namespace tessera {

/// Whether a call did what it was asked, or why not.
enum class [[nodiscard]] Status : std::uint8_t{
    kOk = 0,
    kInvalidArgument,    ///< An argument is outside its documented range; nothing was changed.
    kResourceExhausted,  ///< A fixed capacity is used up; nothing was changed.
    kOutOfRange,         ///< A coordinate lies outside the grid.
    kMismatch,           ///< Two things that must agree (resolution, classes, version) do not.
    kCorrupt,            ///< Stored bytes fail a check (magic, length, checksum, value range).
    kTruncated,          ///< Stored bytes end too early.
    kUnsupported,        ///< A newer format, or a feature this build does not have.
    kIo,                 ///< The injected sink or source reported a failure.
    kBusy,               ///< Another thread was changing it; nothing was read, try again.
};

/// A short lower-case English phrase, for messages.
constexpr const char* to_string(Status status) noexcept {
  switch (status) {
    case Status::kOk:
      return "ok";
    case Status::kInvalidArgument:
      return "invalid argument";
    case Status::kResourceExhausted:
      return "capacity exhausted";
    case Status::kOutOfRange:
      return "outside the grid";
    case Status::kMismatch:
      return "does not match";
    case Status::kCorrupt:
      return "corrupt";
    case Status::kTruncated:
      return "truncated";
    case Status::kUnsupported:
      return "not supported";
    case Status::kIo:
      return "input/output failed";
    case Status::kBusy:
      return "busy";
  }
  return "unknown status";
}

/// A value, or the reason why there is none. T must be movable; the status is never kOk without a
/// value.
template <class T>
class [[nodiscard]] Result {
 public:
  constexpr Result(T value) noexcept : value_(std::move(value)), status_(Status::kOk) {}
  constexpr Result(Status status) noexcept : value_{}, status_(status) {
    TESSERA_ASSERT(status != Status::kOk);
  }

  [[nodiscard]] constexpr bool ok() const noexcept { return status_ == Status::kOk; }
  [[nodiscard]] constexpr Status status() const noexcept { return status_; }
  /// The value; a caller bug (assert) if there is none.
  [[nodiscard]] constexpr T& operator*() noexcept {
    TESSERA_ASSERT(ok());
    return value_;
  }
  [[nodiscard]] constexpr const T& operator*() const noexcept {
    TESSERA_ASSERT(ok());
    return value_;
  }
  [[nodiscard]] constexpr T* operator->() noexcept { return &**this; }
  [[nodiscard]] constexpr const T* operator->() const noexcept { return &**this; }

 private:
  T value_;
  Status status_;
};

}  // namespace tessera
