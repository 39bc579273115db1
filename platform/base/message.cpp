// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "base/message.hpp"

#include <fmt/core.h>

#include <algorithm>

namespace tessera {

std::string name_of(const SettingName& setting, Speaker speaker) {
  if (speaker == Speaker::kCommand && !setting.option.empty()) return std::string(setting.option);
  const bool in_python = speaker == Speaker::kPython;
  if (in_python && !setting.argument.empty()) return std::string(setting.argument);
  if (!setting.key.empty()) return std::string(setting.key);
  if (!in_python) return std::string(setting.option);
  std::string name(setting.option.substr(2));
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

void Message::add(std::string text) {
  if (!text.empty()) parts_.push_back({.text = std::move(text)});
}

Message& Message::operator+=(const Message& more) {
  parts_.insert(parts_.end(), more.parts_.begin(), more.parts_.end());
  return *this;
}

std::string Message::text(Speaker speaker) const {
  std::string text;
  for (const Part& part : parts_) {
    if (part.setting != nullptr) {
      text += name_of(*part.setting, speaker);
    } else {
      const bool in_python = speaker == Speaker::kPython && !part.in_python.empty();
      text += in_python ? part.in_python : part.text;
    }
  }
  return text;
}

const SettingName* Message::subject() const {
  const auto found = std::find_if(parts_.begin(), parts_.end(),
                                  [](const Part& part) { return part.setting != nullptr; });
  return found == parts_.end() ? nullptr : found->setting;
}

Message bytes_text(std::size_t bytes) {
  constexpr std::size_t kMiB = std::size_t{1} << 20U;
  const std::string exact = fmt::format("{} bytes", bytes);
  return bytes % kMiB == 0 && bytes > 0 ? Message(fmt::format("{}M", bytes / kMiB), exact)
                                        : Message(exact);
}

}  // namespace tessera
