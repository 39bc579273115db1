// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// One scan's evidence for an octet: planes of eight counts, and a mask that says which were
// touched.
#include <catch2/catch.hpp>

#include "tessera/semantics/evidence.hpp"

namespace tessera {
namespace {

TEST_CASE("OctetEvidence: starts with no component, and planes are zeros at first") {
  OctetEvidence evidence;
  CHECK(evidence.components() == 0);
  for (int l = 0; l < kMaxComponents; ++l) CHECK(evidence.plane(l) == OctetEvidence::Plane{});
}

TEST_CASE(
    "OctetEvidence: a plane that was asked for counts as touched, one that was not does not") {
  OctetEvidence evidence;
  evidence.plane(0)[1] = 2.0F;
  evidence.plane(kMaxComponents - 1)[7] = 3.0F;
  CHECK(evidence.components() == ((std::uint64_t{1} << 63U) | 1U));
  CHECK(evidence.read(0)[1] == 2.0F);
  CHECK(evidence.read(kMaxComponents - 1)[7] == 3.0F);
}

TEST_CASE("OctetEvidence: clear gives back all zeros") {
  OctetEvidence evidence;
  for (const int l : {0, 3, 31, 32, 63}) evidence.plane(l).fill(1.0F);
  evidence.clear();
  CHECK(evidence.components() == 0);
  for (int l = 0; l < kMaxComponents; ++l) CHECK(evidence.plane(l) == OctetEvidence::Plane{});
}

TEST_CASE(
    "VoxelEvidence: the total counts the components there are, free and unlabelled included") {
  VoxelEvidence evidence;
  evidence.num_components = 4;
  evidence.sigma = {1.0F, 2.0F, 4.0F, 8.0F, 100.0F};
  CHECK(evidence.total() == 15.0);
}

}  // namespace
}  // namespace tessera
