// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What the votes in a map amount to under each of a grid of kernels, at every octet that has points
// of which the true class is known.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <tuple>
#include <vector>

#include "base/outcome.hpp"
#include "tessera/map/local_map.hpp"
#include "tessera/semantics/class_kernel.hpp"

namespace tessera {

/// The kernels that a class may get, the largest last.
class KernelGrid {
 public:
  static constexpr std::array kReach_m{0.25F, 0.5F, 0.8F, 1.1F};
  /// 0.24 at 0.1 m gives the next layer a sixth, 2 nearly all.
  static constexpr std::array kHeight_m{0.2F, 0.24F, 0.4F, 2.0F};
  static constexpr std::size_t kKernels = kReach_m.size() * kHeight_m.size();

  [[nodiscard]] static constexpr ClassKernel kernel(std::size_t number) {
    return {kReach_m[number / kHeight_m.size()], kHeight_m[number % kHeight_m.size()]};
  }
  /// The nearest one: its reach, then its height, by their ratio.
  [[nodiscard]] static std::size_t nearest(const ClassKernel& kernel);
};

class KernelSamples {
 public:
  /// Points of a fold in an octet with the same true class.
  struct Truth {
    std::uint8_t label = 0;
    std::uint32_t fold = 0;
    std::uint32_t points = 0;
  };
  /// A class that has votes around an octet.
  struct Votes {
    std::uint32_t octet = 0;
    std::uint8_t label = 0;
    std::array<float, KernelGrid::kKernels> sums{};  ///< By kernel.
  };
  /// Both in runs, votes by ascending label.
  struct Octet {
    std::uint32_t truth_begin = 0;
    std::uint32_t truth_end = 0;
    std::uint32_t votes_begin = 0;
    std::uint32_t votes_end = 0;
  };

  /// Adds a point of a scan. label: its true class. Points beyond the grid are left out.
  void add_point(const LocalMap& map, const Point3f& p_map, std::uint8_t label, std::uint32_t fold);
  /// After all points: reads the votes of the map, which must keep them. Fails with kFailure iff
  /// the system does not give the memory.
  Outcome<void> read_votes(LocalMap& map);

  [[nodiscard]] std::span<const Octet> octets() const { return octets_; }
  [[nodiscard]] std::span<const Truth> truth(const Octet& octet) const {
    return std::span(truth_).subspan(octet.truth_begin, octet.truth_end - octet.truth_begin);
  }
  [[nodiscard]] std::span<const Votes> votes() const { return votes_; }
  [[nodiscard]] std::span<const Votes> votes(const Octet& octet) const {
    return std::span(votes_).subspan(octet.votes_begin, octet.votes_end - octet.votes_begin);
  }

 private:
  struct Point {
    BlockKey block{};
    std::uint8_t octet = 0;
    std::uint8_t label = 0;
    std::uint32_t fold = 0;
    std::uint32_t count = 0;
    [[nodiscard]] auto place() const { return std::tuple(block, octet, fold, label); }
  };
  void merge();
  /// The places of octets, as octets_.
  struct Place {
    BlockKey block{};
    std::uint8_t octet = 0;
  };

  std::vector<Point> points_;
  std::size_t merge_at_ = std::size_t{1} << 20U;
  std::vector<Place> places_;
  std::vector<Octet> octets_;
  std::vector<Truth> truth_;
  std::vector<Votes> votes_;
};

}  // namespace tessera
