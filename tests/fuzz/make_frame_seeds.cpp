// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "fuzz/sensor_seeds.hpp"
#include "support/team.hpp"
#include "tessera/frames/frame_statements.hpp"

namespace tessera::fuzz {

namespace {

std::vector<std::byte> seed_of(std::span<const std::byte> statement) {
  std::vector<std::byte> seed{std::byte{9}};  // its part in the body "wire"
  seed.insert(seed.end(), statement.begin(), statement.end());
  return seed;
}

}  // namespace

std::vector<std::vector<std::byte>> frame_seeds() {
  std::vector<std::vector<std::byte>> seeds;
  oracle::Random random(6);
  for (int i = 0; i < 6; ++i) {
    FrameLink link{.from = 7, .to = 9, .from_epoch = 1, .revision = 1, .withdrawn = i == 5};
    link.T_from_to = oracle::random_transform(random, 60.0 * i, 40.0);
    std::array<std::byte, FrameLink::kBytes> of_link{};
    if (encode_link(link, of_link) == Status::kOk) seeds.push_back(seed_of(of_link));
    StatedPrior prior{.robot = 7, .epoch = 1, .kind = static_cast<PriorKind>(i % 3)};
    prior.covariance = FrameCovariance::isotropic(Point3d::Zero(), 0.1 * (i + 1), 0.01);
    std::array<std::byte, StatedPrior::kBytes> of_prior{};
    if (encode_prior(prior, of_prior) == Status::kOk) seeds.push_back(seed_of(of_prior));
  }
  return seeds;
}

}  // namespace tessera::fuzz
