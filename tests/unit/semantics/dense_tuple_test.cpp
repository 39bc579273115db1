// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The laws of a tuple policy, on the dense tuple, against a plain array of floats.
#include "tessera/semantics/internal/dense_tuple.hpp"

#include <array>
#include <catch2/catch.hpp>
#include <vector>

#include "support/random.hpp"

namespace tessera {
namespace {

/// An octet of tuples in zeroed memory with canaries behind it.
class Octet {
 public:
  explicit Octet(int num_components)
      : num_components_(num_components), bytes_(DenseTuple::octet_bytes(num_components)) {
    for (std::size_t i = bytes_; i < memory_.size(); ++i) memory_[i] = kCanary;
  }
  std::byte* data() { return memory_.data(); }
  [[nodiscard]] VoxelEvidence read(int voxel) const {
    VoxelEvidence evidence;
    evidence.num_components = num_components_;
    DenseTuple::read(memory_.data(), voxel, evidence);
    return evidence;
  }
  [[nodiscard]] DenseTuple::Plane label_sums() const {
    return DenseTuple::label_sums(memory_.data());
  }
  [[nodiscard]] bool canaries_alive() const {
    for (std::size_t i = bytes_; i < memory_.size(); ++i) {
      if (memory_[i] != kCanary) return false;
    }
    return true;
  }

 private:
  static constexpr std::byte kCanary{0xc5};
  int num_components_;
  std::size_t bytes_;
  alignas(64) std::array<std::byte, 2048 + 64> memory_{};
};

using Model = std::array<std::array<float, kMaxComponents>, kOctetVoxels>;

bool agrees(const Octet& octet, const Model& model, int num_components) {
  const DenseTuple::Plane sums = octet.label_sums();
  for (int v = 0; v < kOctetVoxels; ++v) {
    const VoxelEvidence evidence = octet.read(v);
    const auto& expected = model[static_cast<std::size_t>(v)];
    float sum = 0.0F;
    for (std::size_t l = 1; l < static_cast<std::size_t>(num_components); ++l) {
      if (evidence.sigma[l] != expected[l]) return false;
      sum += expected[l];
    }
    if (evidence.sigma[0] != 0.0F || sums[static_cast<std::size_t>(v)] != sum) return false;
  }
  return true;
}

static_assert(DenseTuple::octet_bytes(3) == 32 + 2 * 32);
static_assert(DenseTuple::octet_bytes(21) == 32 + 20 * 32);
static_assert(DenseTuple::octet_bytes(kMaxComponents) == 32 + 63 * 32);
static_assert(DenseTuple::octet_bytes(kMaxComponents) % 16 == 0, "as the slab pool wants it");

TEST_CASE("DenseTuple: zeroed memory is an octet without evidence") {
  const Octet octet(5);
  CHECK(agrees(octet, Model{}, 5));
}

TEST_CASE("DenseTuple: adding reaches the voxel and component meant and no other") {
  for (const int num_components : {3, 4, 21, kMaxComponents}) {
    for (int component = 1; component < num_components; ++component) {
      for (int voxel = 0; voxel < kOctetVoxels; ++voxel) {
        Octet octet(num_components);
        OctetEvidence added;
        added.plane(component)[static_cast<std::size_t>(voxel)] = 1.25F;
        DenseTuple::add(octet.data(), added);
        Model model{};
        model[static_cast<std::size_t>(voxel)][static_cast<std::size_t>(component)] = 1.25F;
        REQUIRE(agrees(octet, model, num_components));
        REQUIRE(octet.canaries_alive());
      }
    }
  }
}

TEST_CASE("DenseTuple: free evidence is not part of a tuple") {
  Octet octet(4);
  OctetEvidence added;
  added.plane(0).fill(9.0F);
  added.plane(2).fill(1.0F);
  DenseTuple::add(octet.data(), added);
  CHECK(octet.read(3).sigma[0] == 0.0F);
  CHECK(octet.read(3).sigma[2] == 1.0F);
  CHECK(octet.label_sums()[3] == 1.0F);
}

TEST_CASE("DenseTuple: reading leaves the entries of absent components as they are") {
  Octet octet(5);
  OctetEvidence added;
  added.plane(2).fill(1.0F);
  DenseTuple::add(octet.data(), added);
  VoxelEvidence evidence;
  evidence.num_components = 5;
  evidence.sigma.fill(7.0F);
  DenseTuple::read(octet.data(), 0, evidence);
  CHECK(evidence.sigma[2] == 1.0F);
  CHECK(evidence.sigma[0] == 7.0F);
  CHECK(evidence.sigma[1] == 7.0F);
  CHECK(evidence.sigma[4] == 7.0F);
}

TEST_CASE("DenseTuple: adding in two parts equals float addition in that order") {
  Octet octet(3);
  OctetEvidence added;
  added.plane(1).fill(16777216.0F);
  DenseTuple::add(octet.data(), added);
  added.plane(1).fill(1.0F);
  DenseTuple::add(octet.data(), added);
  CHECK(octet.read(0).sigma[1] == 16777216.0F);
}

TEST_CASE("DenseTuple: scaling by one changes nothing, by zero leaves nothing") {
  Octet octet(4);
  OctetEvidence added;
  added.plane(1).fill(0.3F);
  added.plane(3).fill(0.7F);
  DenseTuple::add(octet.data(), added);
  DenseTuple::scale(octet.data(), 5, 1.0F);
  CHECK(octet.read(5).sigma[1] == 0.3F);
  DenseTuple::scale(octet.data(), 5, 0.0F);
  CHECK(octet.read(5).total() == 0.0);
  CHECK(octet.read(4).sigma[3] == 0.7F);
  CHECK(octet.read(6).sigma[3] == 0.7F);
}

TEST_CASE("DenseTuple: agrees with a plain array through random adds and scales") {
  for (const int num_components : {3, 21, kMaxComponents}) {
    const auto seed = static_cast<std::uint64_t>(70 + num_components);
    oracle::Random random(seed);
    Octet octet(num_components);
    Model model{};
    for (int step = 0; step < 1500; ++step) {
      INFO("seed " << seed << ", step " << step);
      if (random.below(4) == 0) {
        const int voxel = random.below(kOctetVoxels);
        const auto factor = static_cast<float>(random.uniform());
        DenseTuple::scale(octet.data(), voxel, factor);
        for (float& count : model[static_cast<std::size_t>(voxel)]) {
          count *= factor;
          if (count < kLeastCount) count = 0.0F;
        }
      } else {
        OctetEvidence added;
        for (int i = random.below(4); i > 0; --i) {
          const int component = 1 + random.below(num_components - 1);
          const auto voxel = static_cast<std::size_t>(random.below(kOctetVoxels));
          added.plane(component)[voxel] = static_cast<float>(random.uniform(0.0, 3.0));
        }
        DenseTuple::add(octet.data(), added);
        for (std::size_t v = 0; v < kOctetVoxels; ++v) {
          for (int l = 1; l < num_components; ++l) {
            if (((added.components() >> static_cast<unsigned>(l)) & 1U) != 0)
              model[v][static_cast<std::size_t>(l)] += added.read(l)[v];
          }
        }
      }
      REQUIRE(agrees(octet, model, num_components));
    }
    CHECK(octet.canaries_alive());
  }
}

TEST_CASE("dense tuple: a copy of whatever was found reads its octet alone and names no more") {
  constexpr int kNumComponents = 7;
  constexpr std::uint64_t kAll = ~std::uint64_t{0};
  const std::array<std::uint64_t, 2> header =
      GENERATE(std::array<std::uint64_t, 2>{kAll, 64}, std::array<std::uint64_t, 2>{kAll, kAll},
               std::array<std::uint64_t, 2>{32, 3}, std::array<std::uint64_t, 2>{32, 0},
               std::array<std::uint64_t, 2>{kAll, 6}, std::array<std::uint64_t, 2>{kAll, 7});
  CAPTURE(header[0], header[1]);
  // Of just that size, for the sanitizer.
  const std::size_t words = DenseTuple::octet_bytes(kNumComponents) / sizeof(std::uint64_t);
  std::vector<std::uint64_t> found(words, 0x3f8000003f800000U);  // ones
  found[0] = header[0];
  found[1] = header[1];
  std::vector<std::uint64_t> copy(words, 0);
  auto* const to = reinterpret_cast<std::byte*>(copy.data());
  DenseTuple::copy_shared(reinterpret_cast<const std::byte*>(found.data()), to, kNumComponents);
  VoxelEvidence evidence;
  evidence.num_components = kNumComponents;
  DenseTuple::read(to, 3, evidence);
  const bool whole = header[0] == kAll && header[1] == 6;
  for (std::size_t l = 0; l < evidence.sigma.size(); ++l)
    CHECK(evidence.sigma[l] == (whole && l >= 1 && l < kNumComponents ? 1.0F : 0.0F));
}

}  // namespace
}  // namespace tessera
