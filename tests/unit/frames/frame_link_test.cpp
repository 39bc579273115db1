// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/frames/frame_link.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <limits>

#include "drawn_links.hpp"
#include "tessera/base/internal/digest.hpp"

namespace tessera {
namespace {

Matrix6d full(const FrameCovariance& covariance) {
  Matrix6d C;
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = 0; j < 6; ++j)
      C(static_cast<int>(i), static_cast<int>(j)) = covariance.values[FrameCovariance::index(i, j)];
  }
  return C;
}

TEST_CASE("FrameLink: what is decoded is near what was encoded, and has the same bytes again") {
  oracle::Random random(251);
  for (int round = 0; round < 500; ++round) {
    const FrameLink link = drawn_link(random);
    LinkBytes bytes{};
    REQUIRE(encode_link(link, bytes) == Status::kOk);
    const FrameLink decoded = *decode_link(bytes);
    CHECK(decoded.from == link.from);
    CHECK(decoded.to == link.to);
    CHECK(decoded.from_epoch == link.from_epoch);
    CHECK(decoded.to_epoch == link.to_epoch);
    CHECK(decoded.from_version == link.from_version);
    CHECK(decoded.to_version == link.to_version);
    CHECK(decoded.revision == link.revision);
    CHECK(decoded.withdrawn == link.withdrawn);
    CHECK((decoded.T_from_to - link.T_from_to).rightCols<1>().cwiseAbs().maxCoeff() <= 0x1p-13);
    CHECK((decoded.T_from_to - link.T_from_to).leftCols<3>().cwiseAbs().maxCoeff() <= 1e-6);
    CHECK((decoded.covariance.about_a - link.covariance.about_a).cwiseAbs().maxCoeff() <= 0x1p-5);
    // Of each unknown by itself, whose steps are its own.
    for (std::size_t i = 0; i < 6; ++i) {
      const std::size_t at = FrameCovariance::index(i, i);
      CHECK(std::abs(std::sqrt(decoded.covariance.values[at]) -
                     std::sqrt(link.covariance.values[at])) <= 4.0 * (i < 3 ? 0x1p-14 : 0x1p-20));
    }
    const FrameLink again = *round_link(decoded);
    CHECK(again.T_from_to == decoded.T_from_to);
    CHECK(again.covariance.values == decoded.covariance.values);
    LinkBytes same{};
    REQUIRE(encode_link(decoded, same) == Status::kOk);
    CHECK(same == bytes);
  }
}

TEST_CASE("FrameLink: a standard deviation under a step does not become zero") {
  FrameLink link;
  link.to = 1;
  link.revision = 1;
  link.covariance = FrameCovariance::isotropic(Point3d::Zero(), 1e-9, 1e-9);
  const FrameLink rounded = *round_link(link);
  CHECK(rounded.covariance.values[0] == 0x1p-28);
  CHECK(rounded.covariance.values[FrameCovariance::index(5, 5)] == 0x1p-40);
}

TEST_CASE("FrameLink: what has no code is refused") {
  FrameLink good;
  good.to = 1;
  good.revision = 1;
  LinkBytes bytes{};
  REQUIRE(encode_link(good, bytes) == Status::kOk);
  const auto refused = [&](const auto& change) {
    FrameLink link = good;
    change(link);
    return encode_link(link, bytes) == Status::kInvalidArgument &&
           round_link(link).status() == Status::kInvalidArgument;
  };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  CHECK(refused([](FrameLink& link) { link.to = link.from; }));
  CHECK(refused([](FrameLink& link) { link.revision = 0; }));
  CHECK(refused([](FrameLink& link) { link.T_from_to(0, 3) = kNan; }));
  CHECK(refused([](FrameLink& link) { link.T_from_to(1, 1) = -1.0; }));
  CHECK(refused([](FrameLink& link) { link.T_from_to(0, 3) = 524'288.0; }));
  CHECK(refused([](FrameLink& link) { link.covariance.about_a(1) = 524'288.0; }));
  CHECK(refused([](FrameLink& link) { link.covariance.about_a(1) = kNan; }));
  CHECK(refused([](FrameLink& link) { link.covariance.values[0] = 0.0; }));
  CHECK(refused([](FrameLink& link) { link.covariance.values[0] = kNan; }));
  CHECK(refused([](FrameLink& link) { link.covariance.values[1] = 1.5; }));  // over one
  CHECK(refused([](FrameLink& link) { link.covariance.values[0] = 512.0 * 512.0; }));
  CHECK(refused([](FrameLink& link) { link.covariance.values[20] = 64.0; }));
  CHECK_FALSE(refused([](FrameLink& link) { link.covariance.values[0] = 511.9 * 511.9; }));
  CHECK_FALSE(refused([](FrameLink& link) { link.covariance.values[20] = 63.9; }));
  CHECK_FALSE(refused([](FrameLink& link) { link.T_from_to(0, 3) = 524'287.0; }));
}

TEST_CASE("FrameLink: no bytes give a link that encode_link would not give") {
  oracle::Random random(252);
  LinkBytes bytes{};
  REQUIRE(encode_link(drawn_link(random), bytes) == Status::kOk);
  CHECK(decode_link(std::span(bytes).first(122)).status() == Status::kTruncated);
  std::array<std::byte, 124> longer{};
  std::copy(bytes.begin(), bytes.end(), longer.begin());
  CHECK(decode_link(longer).status() == Status::kCorrupt);
  int decoded = 0;
  int refused = 0;
  for (int round = 0; round < 20'000; ++round) {
    LinkBytes hostile = bytes;
    for (int flips = 1 + random.below(3); flips > 0; --flips)
      hostile[static_cast<std::size_t>(random.below(FrameLink::kBytes))] =
          static_cast<std::byte>(random.below(256));
    const Result<FrameLink> link = decode_link(hostile);
    if (!link.ok()) {
      CHECK(link.status() == Status::kCorrupt);
      ++refused;
      continue;
    }
    ++decoded;
    LinkBytes again{};
    REQUIRE(encode_link(*link, again) == Status::kOk);
    CHECK(again == hostile);
    CHECK(check_rigid(link->T_from_to) == Status::kOk);
    CHECK(link->from != link->to);
    CHECK(full(link->covariance).llt().info() == Eigen::Success);
  }
  CHECK(decoded > 1000);
  CHECK(refused > 100);
}

TEST_CASE("FrameLink: corrupt fields are found one by one") {
  FrameLink link;
  link.to = 1;
  link.revision = 1;
  LinkBytes good{};
  REQUIRE(encode_link(link, good) == Status::kOk);
  const auto refused = [&](std::size_t at, std::initializer_list<int> values) {
    LinkBytes bytes = good;
    for (const int value : values) bytes[at++] = static_cast<std::byte>(value);
    return decode_link(bytes).status() == Status::kCorrupt;
  };
  CHECK(refused(4, {0}));                  // to itself
  CHECK(refused(24, {0}));                 // revision 0
  CHECK(refused(28, {2}));                 // an unknown flag
  CHECK(refused(50, {4}));                 // no part of a quaternion
  CHECK(refused(51, {0, 0, 0x80}));        // about_a, beyond the range
  CHECK(refused(60, {0, 0, 0}));           // a standard deviation of zero
  CHECK(refused(60, {0xff, 0xff, 0xff}));  // a negative one
  CHECK_FALSE(refused(60, {1, 0, 0}));
}

TEST_CASE("golden digest: the bytes of links are the same on every machine") {
  oracle::Random random(253);
  Digest digest;
  for (int round = 0; round < 100; ++round) {
    LinkBytes bytes{};
    REQUIRE(encode_link(drawn_link(random), bytes) == Status::kOk);
    for (const std::byte value : bytes) digest.add(std::to_integer<std::uint64_t>(value));
  }
  CHECK(digest.value() == 0x6c6d2008f6b37ae0U);
}

}  // namespace
}  // namespace tessera
