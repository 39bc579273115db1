// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The semantic classes of a map: 0 is free, 1 .. C are classes with a name and a colour, C + 1 is
// "occupied, class unknown". C is chosen at run time; a map carries its table, so that a file
// explains itself.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "tessera/base/status.hpp"

namespace tessera {

inline constexpr int kMaxComponents = 64;               ///< C + 2 <= 64.
inline constexpr int kMaxClasses = kMaxComponents - 2;  ///< The largest C.

/// sRGB, as pictures show a class.
struct Color {
  std::uint8_t r = 0;
  std::uint8_t g = 0;
  std::uint8_t b = 0;
  friend constexpr bool operator==(const Color&, const Color&) = default;
};

/// One class: a name of at most 31 bytes (UTF-8, longer ones are cut), zero padded, and a colour
/// for pictures.
struct SemanticClass {
  static constexpr std::size_t kNameBytes = 32;
  std::array<char, kNameBytes> name{};
  Color color{};

  [[nodiscard]] static constexpr SemanticClass make(std::string_view name, Color color) noexcept {
    SemanticClass result;
    const std::size_t length = name.size() < kNameBytes - 1 ? name.size() : kNameBytes - 1;
    for (std::size_t i = 0; i < length; ++i) result.name[i] = name[i];
    result.color = color;
    return result;
  }
  [[nodiscard]] constexpr std::string_view name_view() const noexcept {
    std::size_t length = 0;
    while (length < kNameBytes && name[length] != '\0') ++length;
    return {name.data(), length};
  }
  friend constexpr bool operator==(const SemanticClass&, const SemanticClass&) = default;
};

/// The table of classes 1 .. C. Plain data, about 2.2 kB; no heap.
class ClassTable {
 public:
  constexpr ClassTable() noexcept = default;

  /// Appends the next class. Fails with kResourceExhausted iff there are kMaxClasses already.
  constexpr Status add(std::string_view name, Color color) noexcept {
    if (count_ == kMaxClasses) return Status::kResourceExhausted;
    classes_[static_cast<std::size_t>(count_++)] = SemanticClass::make(name, color);
    return Status::kOk;
  }
  [[nodiscard]] constexpr int num_classes() const noexcept { return count_; }
  [[nodiscard]] constexpr int num_components() const noexcept { return count_ + 2; }
  /// The component of returns whose class is not known, C + 1.
  [[nodiscard]] constexpr int unlabelled() const noexcept { return count_ + 1; }
  /// label in 1 .. C.
  [[nodiscard]] constexpr const SemanticClass& operator[](int label) const noexcept {
    TESSERA_ASSERT(label >= 1 && label <= count_);
    return classes_[static_cast<std::size_t>(label - 1)];
  }
  friend constexpr bool operator==(const ClassTable&, const ClassTable&) = default;

 private:
  std::array<SemanticClass, kMaxClasses> classes_{};
  int count_ = 0;
};

}  // namespace tessera
