// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Solids in a bounding-volume hierarchy: finds the first hit of a ray among thousands in about 1
// us.
#pragma once

#include <cstdint>
#include <vector>

#include "simulator/primitive.hpp"

namespace tessera::street {

class SolidTree {
 public:
  SolidTree() = default;
  explicit SolidTree(std::vector<Primitive> solids);

  /// Shortens `nearest` to the first echo of any solid, if nearer. Reads only; safe from several
  /// threads.
  void meet(const Ray& ray, Hit& nearest) const;

  [[nodiscard]] const std::vector<Primitive>& solids() const { return solids_; }

 private:
  /// A leaf if count > 0: solids_[first, first + count). Else its children are nodes_[first] and
  /// nodes_[first + 1].
  struct Node {
    Bounds bounds;
    std::uint32_t first = 0;
    std::uint32_t count = 0;
  };
  void split(std::uint32_t node, std::vector<Bounds>& bounds);

  std::vector<Primitive> solids_;
  std::vector<Node> nodes_;
};

}  // namespace tessera::street
