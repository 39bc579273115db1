// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a scan saw through, at the finest pixels: where evidence that something is there is
// contradicted (docs/design/theory.md, Evidence that can be contradicted).
#pragma once

#include <cstdint>
#include <span>

#include "tessera/base/arena.hpp"

namespace tessera {

struct ImageRows;

/// By what a voxel counts as seen through.
enum class SeenBy : std::uint8_t {
  /// The nearest that was met in one of the nine pixels around its centre is farther.
  kSome = 0,
  /// All that was met in these nine, and in as wide three rows below them, is farther. Rays that
  /// pass closely over a surface have others below them, which meet it nearer.
  kAll = 1,
};

/// An image for each of these, of one face of a CarveImage at its finest level.
class SeenImage {
 public:
  static constexpr int kWays = 2;
  /// Rows of kAll below a pixel's.
  static constexpr int kRowsBelow = 4;

  [[nodiscard]] static constexpr std::size_t required_bytes(int edge) noexcept {
    return kWays * arena_bytes<std::int16_t>(pixels(edge));
  }
  /// The arena must have required_bytes() left.
  [[nodiscard]] static SeenImage make(Arena& arena, int edge, const ImageRows& rows) noexcept;
  SeenImage() noexcept = default;

  /// A face's nearest depths of returns, in rows first .. last.
  struct Face {
    const std::int16_t* nearest = nullptr;
    int first = 0;
    int last = -1;
    bool goes_up = false;     ///< Its rows follow the map's z.
    std::int16_t none = 0;    ///< Where there was no return: more than any depth.
    std::int16_t unseen = 0;  ///< Less than any depth.
  };
  /// scratch: a face's size. O(pixels of the rows).
  void set(const Face& face, std::int16_t* scratch) noexcept;
  /// Only rows that were set.
  [[nodiscard]] const std::int16_t* values(SeenBy by) const noexcept {
    return images_.data() + static_cast<std::size_t>(by) * pixels(edge_);
  }

 private:
  [[nodiscard]] static constexpr std::size_t pixels(int edge) noexcept {
    return static_cast<std::size_t>(edge) * static_cast<std::size_t>(edge);
  }

  void set_all(const Face& face, std::int16_t* scratch) noexcept;
  void set_some(const Face& face, std::int16_t* scratch) noexcept;

  const ImageRows* row_functions_ = nullptr;
  std::span<std::int16_t> images_;
  int edge_ = 0;
};

}  // namespace tessera
