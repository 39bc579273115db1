// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The member of an object of options that has the value of a setting, whatever its type.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

namespace tessera {

/// The value of a setting; std::monostate: not given. Of an unsigned member of 64 bits the whole
/// number has the bits (SettingMember::wide).
using SettingValue = std::variant<std::monostate, bool, std::int64_t, double, std::string,
                                  std::vector<std::uint32_t>, std::vector<double>>;

enum class SettingKind {
  kSwitch,   ///< On or off: true or false.
  kReal,     ///< A number.
  kWhole,    ///< A whole number.
  kBytes,    ///< A whole number, or text such as "64M".
  kChoice,   ///< One of some words.
  kText,     ///< Any text.
  kPath,     ///< A file or folder; in a configuration file relative to the folder of that.
  kNumbers,  ///< A list of whole numbers.
  kReals,    ///< A list of numbers.
};

/// The values of an enumeration that a setting may have, in the order of messages; to_string names
/// them. Specialised beside the table that uses it.
template <class Choice>
inline constexpr std::array<Choice, 0> kChoicesOf{};

namespace detail {

template <class Choice>
inline constexpr auto kNamesOf = [] {
  std::array<std::string_view, kChoicesOf<Choice>.size()> names{};
  for (std::size_t i = 0; i < names.size(); ++i) names[i] = to_string(kChoicesOf<Choice>[i]);
  return names;
}();

template <class T>
struct Optional : std::false_type {
  using Value = T;
};
template <class T>
struct Optional<std::optional<T>> : std::true_type {
  using Value = T;
};

template <class>
struct Member;
template <class Object, class T>
struct Member<T Object::*> {
  using Owner = Object;
};

template <class Options, class First, class... Rest>
constexpr auto& member_of(Options& options, First first, Rest... rest) {
  if constexpr (sizeof...(rest) == 0) {
    return options.*first;
  } else {
    return member_of(options.*first, rest...);
  }
}

template <class T>
inline constexpr bool kIsWhole = std::is_integral_v<T> && !std::is_same_v<T, bool>;

template <class T>
constexpr SettingKind kind_of() {
  if constexpr (std::is_same_v<T, bool>) {
    return SettingKind::kSwitch;
  } else if constexpr (std::is_same_v<T, double>) {
    return SettingKind::kReal;
  } else if constexpr (kIsWhole<T>) {
    return SettingKind::kWhole;
  } else if constexpr (std::is_enum_v<T>) {
    return SettingKind::kChoice;
  } else if constexpr (std::is_same_v<T, std::string>) {
    return SettingKind::kText;
  } else if constexpr (std::is_same_v<T, std::vector<double>>) {
    return SettingKind::kReals;
  } else {
    static_assert(std::is_same_v<T, std::vector<std::uint32_t>>);
    return SettingKind::kNumbers;
  }
}

template <class T>
SettingValue to_value(const T& value) {
  if constexpr (kIsWhole<T>) {
    return static_cast<std::int64_t>(value);
  } else if constexpr (std::is_enum_v<T>) {
    return std::string(to_string(value));
  } else {
    return value;
  }
}

/// value: as the setting's kind has it, and allowed.
template <class T>
T from_value(const SettingValue& value) {
  if constexpr (kIsWhole<T>) {
    return static_cast<T>(std::get<std::int64_t>(value));
  } else if constexpr (std::is_enum_v<T>) {
    T found{};
    for (const T choice : kChoicesOf<T>) {
      if (std::get<std::string>(value) == to_string(choice)) found = choice;
    }
    return found;
  } else {
    return std::get<T>(value);
  }
}

template <class Options>
inline constexpr char kTagOf = 0;

}  // namespace detail

/// The member of an object of options that has the value of a setting.
struct SettingMember {
  SettingKind kind{};
  bool optional = false;
  bool wide = false;                                 ///< Unsigned, of 64 bits.
  double most = std::numeric_limits<double>::max();  ///< That its type can hold.
  double least = -std::numeric_limits<double>::max();
  std::span<const std::string_view> choices{};
  const char* owner = nullptr;  ///< Stands for the type of the object.
  SettingValue (*get)(const void* options) = nullptr;
  void (*set)(void* options, const SettingValue& value) = nullptr;
};

/// &Options::member, and members of that.
template <auto kFirst, auto... kRest>
constexpr SettingMember member() {
  using Options = typename detail::Member<decltype(kFirst)>::Owner;
  using T =
      std::remove_cvref_t<decltype(detail::member_of(std::declval<Options&>(), kFirst, kRest...))>;
  using Value = typename detail::Optional<T>::Value;
  SettingMember made;
  made.kind = detail::kind_of<Value>();
  made.optional = detail::Optional<T>::value;
  made.owner = &detail::kTagOf<Options>;
  if constexpr (detail::kIsWhole<Value>) {
    made.least = static_cast<double>(std::numeric_limits<Value>::min());
    made.most = static_cast<double>(std::numeric_limits<Value>::max());
    made.wide = std::is_unsigned_v<Value> && sizeof(Value) == sizeof(std::uint64_t);
  }
  if constexpr (std::is_enum_v<Value>) made.choices = detail::kNamesOf<Value>;
  made.get = [](const void* options) -> SettingValue {
    const T& held = detail::member_of(*static_cast<const Options*>(options), kFirst, kRest...);
    if constexpr (detail::Optional<T>::value) {
      return held ? detail::to_value<Value>(*held) : SettingValue();
    } else {
      return detail::to_value<Value>(held);
    }
  };
  made.set = [](void* options, const SettingValue& value) {
    T& held = detail::member_of(*static_cast<Options*>(options), kFirst, kRest...);
    if constexpr (detail::Optional<T>::value) {
      held.reset();
      if (!std::holds_alternative<std::monostate>(value)) held = detail::from_value<Value>(value);
    } else {
      held = detail::from_value<Value>(value);
    }
  };
  return made;
}

}  // namespace tessera
