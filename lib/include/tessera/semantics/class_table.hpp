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
#include "tessera/semantics/class_kernel.hpp"
#include "tessera/semantics/internal/class_name.hpp"

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

/// True iff a class of this name moves unless its table says otherwise: vehicles, people, animals.
/// Names of common data sets. O(names).
[[nodiscard]] constexpr bool moves_by_name(std::string_view name) noexcept {
  constexpr std::array<std::string_view, 37> kNames{
      "animal",        "bicycle",    "bicyclist",  "bird",         "boat",          "bus",
      "car",           "cat",        "cow",        "cyclist",      "dog",           "forklift",
      "horse",         "human",      "motorcycle", "motorcyclist", "moving-object", "on-rails",
      "other-vehicle", "pedestrian", "people",     "person",       "rider",         "robot",
      "scooter",       "sheep",      "ship",       "stroller",     "tractor",       "trailer",
      "train",         "tram",       "truck",      "van",          "vehicle",       "wheelchair",
      "worker"};
  return detail::is_one_of(name, kNames);
}

/// The table of classes 1 .. C. Plain data, about 2.7 kB; no heap.
class ClassTable {
 public:
  constexpr ClassTable() noexcept = default;

  /// Appends the next class. moves: whether things of this class may move. Fails with
  /// kResourceExhausted iff there are kMaxClasses already.
  constexpr Status add(std::string_view name, Color color, bool moves) noexcept {
    if (count_ == kMaxClasses) return Status::kResourceExhausted;
    classes_[static_cast<std::size_t>(count_++)] = SemanticClass::make(name, color);
    if (moves) moving_ |= std::uint64_t{1} << static_cast<unsigned>(count_);
    kernels_[static_cast<std::size_t>(count_ - 1)] = kernel_by_name(name);
    return Status::kOk;
  }
  /// The same for a class that moves if its name says so.
  constexpr Status add(std::string_view name, Color color) noexcept {
    return add(name, color, moves_by_name(name));
  }
  [[nodiscard]] constexpr int num_classes() const noexcept { return count_; }
  [[nodiscard]] constexpr int num_components() const noexcept { return count_ + 2; }
  /// The component of returns whose class is not known, C + 1.
  [[nodiscard]] constexpr int unlabelled() const noexcept { return count_ + 1; }
  /// The components of classes that may move, a bit each.
  [[nodiscard]] constexpr std::uint64_t moving() const noexcept { return moving_; }
  /// Whether things of that class may move. label in 1 .. C.
  [[nodiscard]] constexpr bool moves(int label) const noexcept {
    return (moving_ >> static_cast<unsigned>(label) & 1U) != 0;
  }
  /// Of the lattice mode. label in 1 .. C.
  [[nodiscard]] constexpr const ClassKernel& kernel(int label) const noexcept {
    TESSERA_ASSERT(label >= 1 && label <= count_);
    return kernels_[static_cast<std::size_t>(label - 1)];
  }
  /// Instead of kernel_by_name(). label in 1 .. C. Fails with kInvalidArgument iff the kernel is
  /// not valid.
  constexpr Status set_kernel(int label, const ClassKernel& kernel) noexcept {
    TESSERA_ASSERT(label >= 1 && label <= count_);
    if (!kernel.is_valid()) return Status::kInvalidArgument;
    kernels_[static_cast<std::size_t>(label - 1)] = kernel;
    return Status::kOk;
  }
  /// label in 1 .. C.
  [[nodiscard]] constexpr const SemanticClass& operator[](int label) const noexcept {
    TESSERA_ASSERT(label >= 1 && label <= count_);
    return classes_[static_cast<std::size_t>(label - 1)];
  }
  /// The same classes. What moves, and kernels, are how a map is made, not what it says.
  friend constexpr bool operator==(const ClassTable& a, const ClassTable& b) noexcept {
    return a.count_ == b.count_ && a.classes_ == b.classes_;
  }

 private:
  std::array<SemanticClass, kMaxClasses> classes_{};
  std::array<ClassKernel, kMaxClasses> kernels_{};
  std::uint64_t moving_ = 0;
  int count_ = 0;
};

}  // namespace tessera
