// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a robot states of its own frame, as bytes.
#include <algorithm>

#include "drawn_links.hpp"
#include "tessera/base/internal/digest.hpp"

namespace tessera {
namespace {

StatedPrior drawn_prior(oracle::Random& random) {
  StatedPrior prior;
  prior.robot = static_cast<std::uint32_t>(random.bits());
  prior.epoch = static_cast<std::uint32_t>(random.bits());
  prior.kind = static_cast<PriorKind>(random.below(3));
  prior.covariance = drawn_covariance(random);
  return prior;
}

TEST_CASE("StatedPrior: what is decoded is near what was encoded, and has the same bytes again") {
  oracle::Random random(261);
  for (int round = 0; round < 300; ++round) {
    const StatedPrior prior = drawn_prior(random);
    const PriorBytes bytes = bytes_of(prior);
    const StatedPrior decoded = *decode_prior(bytes);
    CHECK(decoded.robot == prior.robot);
    CHECK(decoded.epoch == prior.epoch);
    CHECK(decoded.kind == prior.kind);
    CHECK(bytes_of(decoded) == bytes);
    const std::optional<FramePrior> given = prior_of(decoded);
    REQUIRE(given.has_value() == (prior.kind != PriorKind::kUnknown));
    if (!given) continue;
    CHECK(given->robot == prior.robot);
    CHECK(given->T_team_robot == Matrix34d::Identity());
    CHECK(given->exact == (prior.kind == PriorKind::kExact));
    if (given->exact) continue;
    CHECK((given->covariance.about_a - prior.covariance.about_a).cwiseAbs().maxCoeff() <= 0x1p-5);
    CHECK(std::abs(given->covariance.sigma_m() - prior.covariance.sigma_m()) < 0x1p-11);
    CHECK(std::abs(given->covariance.sigma_rad() - prior.covariance.sigma_rad()) < 0x1p-17);
  }
}

TEST_CASE("StatedPrior: its covariance has the code that it has in a link") {
  oracle::Random random(262);
  StatedPrior prior = drawn_prior(random);
  prior.kind = PriorKind::kVague;
  FrameLink link = drawn_link(random);
  link.covariance = prior.covariance;
  const LinkBytes of_link = bytes_of(link);
  const PriorBytes of_prior = bytes_of(prior);
  CHECK(std::equal(of_prior.begin() + 9, of_prior.end(), of_link.begin() + 51, of_link.end()));
}

TEST_CASE("StatedPrior: what has no code is refused") {
  StatedPrior prior;
  PriorBytes bytes{};
  prior.kind = static_cast<PriorKind>(3);
  CHECK(encode_prior(prior, bytes) == Status::kInvalidArgument);
  prior.kind = PriorKind::kVague;  // with a covariance that is exact
  CHECK(encode_prior(prior, bytes) == Status::kInvalidArgument);
  prior.covariance = FrameCovariance::isotropic(Point3d::Zero(), 512.0, 0.1);
  CHECK(encode_prior(prior, bytes) == Status::kInvalidArgument);
  prior.covariance = FrameCovariance::isotropic({524'288.0, 0, 0}, 1.0, 0.1);
  CHECK(encode_prior(prior, bytes) == Status::kInvalidArgument);
  // Where it has no meaning it may be any.
  prior.kind = PriorKind::kExact;
  CHECK(encode_prior(prior, bytes) == Status::kOk);
}

TEST_CASE("StatedPrior: no bytes give a prior that encode_prior would not give") {
  oracle::Random random(263);
  int decoded = 0;
  int refused = 0;
  for (int round = 0; round < 20'000; ++round) {
    PriorBytes bytes = bytes_of(drawn_prior(random));
    for (int flips = 1 + random.below(2); flips > 0; --flips) {
      // Half of them among robot, epoch and kind.
      const int below = random.below(2) == 0 ? 9 : static_cast<int>(StatedPrior::kBytes);
      bytes[static_cast<std::size_t>(random.below(below))] =
          static_cast<std::byte>(random.below(2) == 0 ? random.below(4) : random.below(256));
    }
    const Result<StatedPrior> prior = decode_prior(bytes);
    (prior.ok() ? decoded : refused) += 1;
    if (prior.ok()) {
      REQUIRE(bytes_of(*prior) == bytes);
    } else {
      REQUIRE(prior.status() == Status::kCorrupt);
    }
  }
  CHECK(decoded > 1000);
  CHECK(refused > 1000);
  const PriorBytes good = bytes_of(drawn_prior(random));
  CHECK(decode_prior(std::span(good).first(80)).status() == Status::kTruncated);
  std::array<std::byte, 82> longer{};
  CHECK(decode_prior(longer).status() == Status::kCorrupt);
  // One that is not vague says nothing of a covariance.
  PriorBytes exact = bytes_of(StatedPrior{.kind = PriorKind::kExact});
  exact[80] = std::byte{1};
  CHECK(decode_prior(exact).status() == Status::kCorrupt);
}

TEST_CASE("golden digest: the bytes of stated priors are the same on every machine") {
  oracle::Random random(264);
  Digest digest;
  for (int round = 0; round < 100; ++round)
    for (const std::byte value : bytes_of(drawn_prior(random)))
      digest.add(std::to_integer<std::uint64_t>(value));
  CHECK(digest.value() == 0xb5780284edd633f8U);
}

}  // namespace
}  // namespace tessera
