// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How platform code reports failures that a user can fix: one line with what, where, and the
// remedy.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "base/message.hpp"

namespace tessera {

/// kUsage for bad input (exit status 1), kFailure for work that could not be completed (exit status
/// 2).
enum class FailureKind { kUsage, kFailure };

struct Failure {
  Message message;
  FailureKind kind = FailureKind::kUsage;

  [[nodiscard]] std::string text(Speaker speaker = Speaker::kCommand) const {
    return message.text(speaker);
  }
};

/// Untrusted text for a message: control characters become spaces, so that it stays one line and
/// does not affect a terminal.
inline std::string one_line(std::string_view text) {
  std::string line(text);
  for (char& letter : line) {
    const auto byte = static_cast<unsigned char>(letter);
    if (byte < 0x20 || byte == 0x7f) letter = ' ';
  }
  return line;
}

/// A value of T or a Failure. Outcome<void> has no value.
template <class T>
class [[nodiscard]] Outcome {
 public:
  Outcome(T value) : value_(std::move(value)) {}
  Outcome(Failure failure) : failure_(std::move(failure)) {}
  [[nodiscard]] bool ok() const { return value_.has_value(); }
  [[nodiscard]] const Failure& failure() const { return failure_; }
  [[nodiscard]] T& operator*() { return *value_; }
  [[nodiscard]] const T& operator*() const { return *value_; }
  [[nodiscard]] T* operator->() { return &*value_; }
  [[nodiscard]] const T* operator->() const { return &*value_; }

 private:
  std::optional<T> value_;
  Failure failure_;
};

template <>
class [[nodiscard]] Outcome<void> {
 public:
  Outcome() = default;
  Outcome(Failure failure) : failure_(std::move(failure)), ok_(false) {}
  [[nodiscard]] bool ok() const { return ok_; }
  [[nodiscard]] const Failure& failure() const { return failure_; }

 private:
  Failure failure_;
  bool ok_ = true;
};

}  // namespace tessera

/// Returns the failure of an Outcome, if it has one, from the function around it.
#define TESSERA_TRY(...)                                                        \
  do {                                                                          \
    if (const auto& tried = (__VA_ARGS__); !tried.ok()) return tried.failure(); \
  } while (false)

/// The same, and declares a variable with the value:
/// `TESSERA_TRY_ASSIGN(const std::string text, read_text_file(path, kMostBytes));`
#define TESSERA_TRY_ASSIGN(declaration, ...) \
  TESSERA_TRY_ASSIGN_BY(TESSERA_JOINED(tried_at_, __LINE__), declaration, __VA_ARGS__)
#define TESSERA_TRY_ASSIGN_BY(tried, declaration, ...) \
  auto tried = (__VA_ARGS__);                          \
  if (!tried.ok()) return tried.failure();             \
  declaration = std::move(*tried)
#define TESSERA_JOINED(a, b) TESSERA_JOINED_AGAIN(a, b)
#define TESSERA_JOINED_AGAIN(a, b) a##b
