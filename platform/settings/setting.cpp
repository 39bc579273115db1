// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "settings/setting.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <limits>
#include <system_error>
#include <utility>

#include "base/number_text.hpp"

namespace tessera {

namespace {

template <class Number>
std::optional<Number> parse(const std::string& text) {
  Number value{};
  const char* const end = text.data() + text.size();
  const auto [stopped, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc{} || stopped != end) return std::nullopt;
  return value;
}

/// "0.5,-1": as many as there are.
std::optional<std::vector<double>> parse_reals(const std::string& text) {
  std::vector<double> reals;
  const char* at = text.data();
  const char* const end = at + text.size();
  while (true) {
    const auto [stopped, error] = std::from_chars(at, end, reals.emplace_back());
    if (error != std::errc{} || (stopped != end && *stopped != ',')) return std::nullopt;
    if (stopped == end) break;
    at = stopped + 1;
  }
  return reals;
}

struct Limits {
  double least;
  double most;
};

Limits limits_of(const Setting& setting) {
  return {std::max(setting.allowed.least, setting.member.least),
          std::min(setting.allowed.most, setting.member.most)};
}

/// "1e6" and not "1e+06".
std::string number_text(const Setting& setting, double value) {
  if (setting.kind != SettingKind::kReal) {
    // The largest numbers of 64 bits are no doubles.
    if (value >= 0x1p64) return std::to_string(std::numeric_limits<std::uint64_t>::max());
    if (value >= 0x1p63) return std::to_string(std::numeric_limits<std::int64_t>::max());
    return std::to_string(static_cast<std::int64_t>(value));
  }
  std::string text = text_of(value);
  if (const std::size_t sign = text.find("e+0"); sign != std::string::npos) text.erase(sign + 1, 2);
  return text;
}

bool is_zero(double value) { return value >= 0.0 && value <= 0.0; }

/// 0 has a word of its own.
bool has_word_for(const Setting& setting, double value) {
  return is_zero(value) && !setting.allowed.zero.empty() && setting.allowed.zero != "0";
}

/// "from 1 to 9"; empty: without limits.
std::string range_text(const Setting& setting, Limits limits) {
  const auto [least, most] = limits;
  if (least <= -1e300) return "";
  const bool ends = most < 1e300;
  const std::string from = number_text(setting, least);
  const std::string to = ends ? number_text(setting, most) : "";
  if (setting.allowed.below) return "between " + from + " and " + to;
  if (setting.allowed.above) return "above " + from + (ends ? ", to " + to : "");
  return "from " + from + (ends ? " to " + to : "");
}

std::string listed(std::span<const std::string_view> words) {
  std::string text;
  for (const std::string_view word : words) {
    if (!text.empty()) text += word == words.back() ? " or " : ", ";
    text += word;
  }
  return text;
}

/// A whole number as its member has it.
double as_number(const Setting& setting, std::int64_t whole) {
  return setting.member.wide ? static_cast<double>(static_cast<std::uint64_t>(whole))
                             : static_cast<double>(whole);
}

bool is_in_range(const Setting& setting, double value) {
  if (!setting.allowed.zero.empty() && is_zero(value)) return true;
  const auto [least, most] = limits_of(setting);
  const bool high_enough = setting.allowed.above ? value > least : value >= least;
  return high_enough && (setting.allowed.below ? value < most : value <= most);
}

/// By its type alone.
bool is_of_kind(SettingKind kind, const SettingValue& value) {
  switch (kind) {
    case SettingKind::kSwitch:
      return std::holds_alternative<bool>(value);
    case SettingKind::kReal:
      return std::holds_alternative<double>(value);
    case SettingKind::kWhole:
    case SettingKind::kBytes:
      return std::holds_alternative<std::int64_t>(value);
    case SettingKind::kChoice:
    case SettingKind::kText:
    case SettingKind::kPath:
      return std::holds_alternative<std::string>(value);
    case SettingKind::kReals:
      return std::holds_alternative<std::vector<double>>(value);
    case SettingKind::kNumbers:
      break;
  }
  return std::holds_alternative<std::vector<std::uint32_t>>(value);
}

bool is_allowed(const Setting& setting, const SettingValue& value) {
  if (std::holds_alternative<std::monostate>(value)) return setting.member.optional;
  if (!is_of_kind(setting.kind, value)) return false;
  if (const auto* const real = std::get_if<double>(&value)) return is_in_range(setting, *real);
  if (const auto* const whole = std::get_if<std::int64_t>(&value))
    return is_in_range(setting, as_number(setting, *whole));
  if (setting.kind != SettingKind::kChoice) return true;
  const auto words = setting.words();
  return std::find(words.begin(), words.end(), std::get<std::string>(value)) != words.end();
}

}  // namespace

Failure not_allowed(const SettingName& setting, const std::string& given, const Message& allowed) {
  return {Message(setting) + " " + one_line(given) + " is not allowed; give " + allowed};
}

Message allowed_text(const Setting& setting) {
  const Allowed& allowed = setting.allowed;
  if (!allowed.words.empty()) return std::string(allowed.words);
  switch (setting.kind) {
    case SettingKind::kSwitch:
      return {"on or off", "True or False"};
    case SettingKind::kBytes:
      return {"bytes, or a number with K, M or G", "bytes, at most 10^15"};
    case SettingKind::kChoice:
      return listed(setting.words());
    case SettingKind::kText:
      return "text";
    case SettingKind::kPath:
      return "a path";
    case SettingKind::kNumbers:
      return "a list of whole numbers, such as [1, 2]";
    case SettingKind::kReals:
      return {"numbers with commas between them", "a list of numbers"};
    case SettingKind::kReal:
    case SettingKind::kWhole:
      break;
  }
  const bool real = setting.kind == SettingKind::kReal;
  std::string text(!allowed.what.empty() ? allowed.what : real ? "a number" : "a whole number");
  const std::string range = range_text(setting, limits_of(setting));
  if (!range.empty()) text += " " + range;
  if (allowed.zero.empty()) return text;
  return Message(text) + Message(", or " + std::string(allowed.zero), ", or 0 for none");
}

Message stated_range(const Setting& setting) {
  const Allowed& allowed = setting.allowed;
  const SettingKind kind = setting.kind;
  if (kind == SettingKind::kBytes) return {"bytes, or with K, M or G", "bytes"};
  if (kind != SettingKind::kReal && kind != SettingKind::kWhole) return {};
  if (!allowed.words.empty()) return std::string(allowed.words);
  Message text = (allowed.what.empty() ? "" : std::string(allowed.what) + " ") +
                 range_text(setting, {allowed.least, allowed.most});
  if (!allowed.zero.empty() && allowed.zero != "0") text += ", or " + std::string(allowed.zero);
  return text;
}

Outcome<void> assign(const Setting& setting, void* options, const SettingValue& value) {
  if (!is_allowed(setting, value))
    return not_allowed(setting.name, text_of(setting, value), allowed_text(setting));
  setting.member.set(options, value);
  return {};
}

Outcome<SettingValue> parse_value(const Setting& setting, const std::string& text) {
  std::optional<SettingValue> value;
  switch (setting.kind) {
    case SettingKind::kSwitch:
      if (text == "on" || text == "off") value = text == "on";
      break;
    case SettingKind::kReal:
      if (!setting.allowed.zero.empty() && text == setting.allowed.zero) {
        value = 0.0;
      } else if (const std::optional<double> real = parse<double>(text);
                 real && !has_word_for(setting, *real)) {
        value = *real;
      }
      break;
    case SettingKind::kWhole:
      if (setting.member.wide) {
        if (const auto whole = parse<std::uint64_t>(text))
          value = static_cast<std::int64_t>(*whole);
      } else if (const auto whole = parse<std::int64_t>(text)) {
        value = *whole;
      }
      break;
    case SettingKind::kBytes:
      if (const std::optional<std::size_t> bytes = parse_bytes(text))
        value = static_cast<std::int64_t>(*bytes);
      break;
    case SettingKind::kChoice:
    case SettingKind::kText:
    case SettingKind::kPath:
      value = text;
      break;
    case SettingKind::kReals:
      if (std::optional<std::vector<double>> reals = parse_reals(text)) value = std::move(*reals);
      break;
    case SettingKind::kNumbers:
      break;
  }
  if (!value || !is_allowed(setting, *value))
    return not_allowed(setting.name, text, allowed_text(setting));
  return *value;
}

std::string text_of(const Setting& setting, const SettingValue& value) {
  if (const auto* const on = std::get_if<bool>(&value)) return *on ? "on" : "off";
  if (const auto* const whole = std::get_if<std::int64_t>(&value)) {
    const bool bytes = setting.kind == SettingKind::kBytes && *whole >= 0;
    if (bytes) return bytes_text(static_cast<std::size_t>(*whole)).text();
    return setting.member.wide ? std::to_string(static_cast<std::uint64_t>(*whole))
                               : std::to_string(*whole);
  }
  if (const auto* const real = std::get_if<double>(&value))
    return has_word_for(setting, *real) ? std::string(setting.allowed.zero) : text_of(*real);
  if (const auto* const text = std::get_if<std::string>(&value)) return *text;
  if (const auto* const reals = std::get_if<std::vector<double>>(&value)) {
    std::string text;
    for (const double real : *reals)
      text += fmt::format("{}{}", text.empty() ? "" : ",", text_of(real));
    return text;
  }
  const auto* const numbers = std::get_if<std::vector<std::uint32_t>>(&value);
  if (numbers == nullptr) return "";
  std::string text = "[";
  for (const std::uint32_t number : *numbers)
    text += fmt::format("{}{}", (text.size() > 1 ? ", " : ""), number);
  return text + "]";
}

Json json_of(const Setting& setting, const void* options) {
  const SettingValue value = setting.member.get(options);
  if (const auto* const whole = std::get_if<std::int64_t>(&value); whole && setting.member.wide)
    return static_cast<std::uint64_t>(*whole);
  const auto* const real = std::get_if<double>(&value);
  if (real != nullptr && has_word_for(setting, *real)) return std::string(setting.allowed.zero);
  if (std::holds_alternative<bool>(value) && !setting.flag) return text_of(setting, value);
  return std::visit(
      [](const auto& held) -> Json {
        if constexpr (std::is_same_v<std::remove_cvref_t<decltype(held)>, std::monostate>) {
          return {};
        } else {
          return held;
        }
      },
      value);
}

namespace detail {

Json json_of(std::span<const Setting> rows, const void* options) {
  Json json = Json::object();
  for (const Setting& row : rows) {
    std::string key(row.name.option.substr(2));
    std::replace(key.begin(), key.end(), '-', '_');
    json[key] = tessera::json_of(row, options);
  }
  return json;
}

}  // namespace detail

}  // namespace tessera
