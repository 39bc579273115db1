// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Text that names settings. The same sentence is printed by the command line, about a line of a
// configuration file, and as an exception in Python; each has its own names for a setting.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace tessera {

/// How one setting is called. It has an option or a key.
struct SettingName {
  std::string_view option{};    ///< On the command line: "--max-range".
  std::string_view table{};     ///< In a configuration file: "map",
  std::string_view key{};       ///< "max_range_m".
  std::string_view argument{};  ///< In Python; empty: the key, or the option without dashes.
};

/// Who prints a message.
enum class Speaker { kCommand, kFile, kPython };

/// The name for a speaker, or the other's if it has none: "--max-range", "max_range_m".
[[nodiscard]] std::string name_of(const SettingName& setting, Speaker speaker);

class Message {
 public:
  Message() = default;
  Message(std::string text) { add(std::move(text)); }
  Message(const char* text) : Message(std::string(text)) {}
  /// setting: must outlive the message.
  Message(const SettingName& setting) { parts_.push_back({.setting = &setting}); }
  /// Words that Python says differently: "off" and "0", "64M" and "67108864 bytes".
  Message(std::string text, std::string in_python) {
    parts_.push_back({.text = std::move(text), .in_python = std::move(in_python)});
  }

  Message& operator+=(const Message& more);
  [[nodiscard]] std::string text(Speaker speaker = Speaker::kCommand) const;
  /// The setting that is named first; null if none is.
  [[nodiscard]] const SettingName* subject() const;
  /// True if it begins with the name of its subject.
  [[nodiscard]] bool begins_with_subject() const {
    return !parts_.empty() && parts_.front().setting != nullptr;
  }

 private:
  struct Part {
    std::string text{};
    std::string in_python{};  ///< Empty: as text.
    const SettingName* setting = nullptr;
  };
  void add(std::string text);

  std::vector<Part> parts_;
};

inline Message operator+(Message first, const Message& second) {
  first += second;
  return first;
}

/// An amount of memory: "64M", "100 bytes"; in Python "67108864 bytes".
[[nodiscard]] Message bytes_text(std::size_t bytes);

}  // namespace tessera
