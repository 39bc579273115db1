// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Where a robot says that it is, as 32 bytes: what comes back, what is refused, and when it is due.
#include "tessera/exchange/presence.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <span>

#include "support/random.hpp"
#include "tessera/base/rigid.hpp"
#include "tessera/exchange/internal/presence_sender.hpp"
#include "tessera/exchange/wire.hpp"

namespace tessera {
namespace {

using Bytes = std::array<std::byte, Presence::kBytes>;

const BodyBox kBox{{-2.1F, -0.9F, -0.3F}, {2.4F, 0.9F, 1.6F}};

Matrix34d pose(oracle::Random& random, double reach_m) {
  const auto drawn = [&](double reach) { return random.uniform(-reach, reach); };
  Matrix34d T = Matrix34d::Identity();
  T.leftCols<3>() =
      Eigen::AngleAxisd(drawn(3.1), Eigen::Vector3d(drawn(1.0), 0.1, drawn(1.0)).normalized())
          .toRotationMatrix();
  T.col(3) = Eigen::Vector3d(drawn(reach_m), drawn(reach_m), drawn(reach_m));
  return T;
}

bool is_written(const Presence& presence) {
  Bytes bytes{};
  ByteWriter to(bytes);
  const bool written = write_presence(to, presence);
  REQUIRE(to.size() == (written ? Presence::kBytes : 0));
  return written;
}

Presence with_box(const BodyBox& box) {
  Presence presence;
  presence.box = box;
  return presence;
}

}  // namespace

TEST_CASE("presence: with a header, a signature and a tag it is 144 bytes") {
  CHECK(kHeaderBytes + Presence::kBytes + kSignatureBytes + kTagBytes == 144);
}

TEST_CASE("presence: what is written is read, places to a millimetre and boxes outwards") {
  oracle::Random random(71);
  for (int i = 0; i < 2000; ++i) {
    Presence said;
    said.T_global_body = pose(random, i % 2 == 0 ? 100.0 : 2e6);
    const double size = std::array{0.3, 1.2, 2.5, 5.0, 7.9}[static_cast<std::size_t>(i % 5)];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      said.box.low[axis] = static_cast<float>(-random.uniform(0.0, size));
      said.box.high[axis] = static_cast<float>(random.uniform(0.02, size));
    }
    said.stamp_ms = random.below(1'000'000) * 250'000'000LL;
    said.age_ms = static_cast<std::uint32_t>(random.below(1500));
    said.speed_m_per_s = static_cast<std::uint8_t>(random.below(90));
    Bytes bytes{};
    ByteWriter to(bytes);
    REQUIRE(write_presence(to, said));
    REQUIRE(to.size() == Presence::kBytes);
    ByteReader from(bytes);
    Presence heard;
    REQUIRE(read_presence(from, heard));
    CHECK(from.remaining() == 0);
    CHECK(heard.stamp_ms == said.stamp_ms);
    CHECK(heard.age_ms == std::min(said.age_ms, 1020U) / 4 * 4);
    CHECK(heard.speed_m_per_s == std::min<int>(said.speed_m_per_s, 63));
    CHECK(check_rigid(heard.T_global_body) == Status::kOk);
    CHECK(Presence::is_plausible(heard.box));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double unit = size > 5.08 ? 0.08 : size > 2.54 ? 0.04 : size > 1.27 ? 0.02 : 0.01;
      const double low =
          static_cast<double>(said.box.low[axis]) - static_cast<double>(heard.box.low[axis]);
      const double high =
          static_cast<double>(heard.box.high[axis]) - static_cast<double>(said.box.high[axis]);
      CHECK((low >= -1e-6 && low <= unit + 1e-6));
      CHECK((high >= -1e-6 && high <= unit + 1e-6));
    }
    for (const Point3d& p : {Point3d(8, 0, 0), Point3d(0, -8, 1), Point3d(0, 0, 3)})
      CHECK(norm(apply(heard.T_global_body, p) - apply(said.T_global_body, p)) < 0.003);
  }
}

TEST_CASE("presence: positions are rounded to the nearest step, halves away from 0") {
  Presence said = with_box(kBox);
  said.T_global_body.col(3) = Point3d(-0.5, 0.5, -1.49) / 1024.0;
  Bytes bytes{};
  ByteWriter to(bytes);
  REQUIRE(write_presence(to, said));
  ByteReader from(bytes);
  Presence heard;
  REQUIRE(read_presence(from, heard));
  CHECK(heard.T_global_body.col(3) == Point3d(-1.0, 1.0, -1.0) / 1024.0);
}

TEST_CASE("presence: of fewer bytes none is read, and any 32 give a place or nothing") {
  Bytes bytes{};
  ByteWriter to(bytes);
  REQUIRE(write_presence(to, with_box(kBox)));
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    ByteReader from(std::span<const std::byte>(bytes).first(size));
    Presence heard;
    CHECK_FALSE(read_presence(from, heard));
  }
  oracle::Random random(72);
  int read = 0;
  int plausible = 0;
  for (int i = 0; i < 20'000; ++i) {
    for (std::byte& byte : bytes) byte = static_cast<std::byte>(random.below(256));
    ByteReader from(bytes);
    Presence heard;
    if (!read_presence(from, heard)) continue;
    ++read;
    REQUIRE(check_rigid(heard.T_global_body) == Status::kOk);
    REQUIRE(heard.T_global_body.cwiseAbs().maxCoeff() <= Presence::kMostMetres + 2.0);
    if (!Presence::is_plausible(heard.box)) continue;
    ++plausible;
    for (std::size_t axis = 0; axis < 3; ++axis)
      REQUIRE(heard.box.high[axis] - heard.box.low[axis] <= 16.0F);
  }
  CHECK(read > 200);
  CHECK(plausible > 10);
}

TEST_CASE("presence: what is too large, turned inside out or no number is not written") {
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  CHECK(is_written(with_box(kBox)));
  CHECK(is_written(with_box({{-8, -8, -8}, {8, 8, 8}})));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const auto& [low, high] : {std::pair{-8.0F, 8.1F},
                                    {-10.3F, 0.0F},
                                    {9.0F, 10.2F},
                                    {1.0F, 1.0F},
                                    {1.0F, -1.0F},
                                    {kNaN, 1.0F},
                                    {-1.0F, kNaN},
                                    {-kInfinity, 1.0F},
                                    {-1.0F, kInfinity}}) {
      BodyBox box = kBox;
      box.low[axis] = low;
      box.high[axis] = high;
      CHECK_FALSE(Presence::is_sendable(box));
      CHECK_FALSE(is_written(with_box(box)));
    }
  }
  Presence late = with_box(kBox);
  late.stamp_ms = Presence::kMostStamp_ms;
  CHECK(is_written(late));
  ++late.stamp_ms;
  CHECK_FALSE(is_written(late));
  late.stamp_ms = -1;
  CHECK_FALSE(is_written(late));
  Presence far = with_box(kBox);
  far.T_global_body(1, 3) = -Presence::kMostMetres;
  CHECK(is_written(far));
  far.T_global_body(1, 3) -= 1.0;
  CHECK_FALSE(is_written(far));
  far.T_global_body(1, 3) = std::numeric_limits<double>::quiet_NaN();
  CHECK_FALSE(is_written(far));
  Presence skewed = with_box(kBox);
  skewed.T_global_body(0, 0) = 2.0;
  CHECK_FALSE(is_written(skewed));
  std::array<std::byte, Presence::kBytes - 1> small{};
  ByteWriter to(small);
  CHECK_FALSE(write_presence(to, with_box(kBox)));
  CHECK(to.size() == 0);
}

// --- When it is due ------------------------------------------------------------------------------

namespace {

/// Times a second that a robot at that speed says where it is, and the speed that it says.
struct Drive {
  explicit Drive(double speed_m_per_s, const ExchangeConfig& config = {}) : sender(config) {
    REQUIRE(sender.set_body(kBox) == Status::kOk);
    for (std::int64_t ms = 0; ms < 10'000; ms += 10) {
      Matrix34d T = Matrix34d::Identity();
      T(0, 3) = 1e-3 * static_cast<double>(ms) * speed_m_per_s;
      if (ms % 50 == 0) sender.note(T, 1000 * ms, Instant::at_us(1000 * ms));
      if (!sender.is_due(Instant::at_us(1000 * ms), false)) continue;
      Bytes bytes{};
      ByteWriter to(bytes);
      REQUIRE(sender.write(to, Instant::at_us(1000 * ms)));
      ByteReader from(bytes);
      REQUIRE(read_presence(from, last));
      sent += ms >= 1000 ? 1 : 0;
    }
  }
  PresenceSender sender;
  Presence last;
  int sent = 0;  ///< In the last nine seconds.
};

}  // namespace

TEST_CASE("presence: ten times a second while the robot moves, once while it stands") {
  const Drive moves(2.5);
  CHECK((moves.sent >= 88 && moves.sent <= 90));
  CHECK(moves.last.speed_m_per_s == 3);
  const Drive stands(0.0);
  CHECK((stands.sent >= 8 && stands.sent <= 9));
  CHECK(stands.last.speed_m_per_s == 0);
  CHECK(Drive(1e6).last.speed_m_per_s == 63);
  // At most a quarter of what may be sent at all.
  ExchangeConfig slow;
  slow.bytes_per_s = 1280;
  const Drive held(2.5, slow);
  CHECK((held.sent >= 17 && held.sent <= 18));
}

TEST_CASE("presence: a place that is not known any more is not told, nor is one without a body") {
  PresenceSender sender{ExchangeConfig{}};
  const Matrix34d T = Matrix34d::Identity();
  sender.note(T, 0, Instant::at_us(0));
  CHECK_FALSE(sender.is_due(Instant::at_us(0), true));
  REQUIRE(sender.set_body(kBox) == Status::kOk);
  CHECK_FALSE(sender.is_due(Instant::at_us(0), true));
  sender.note(T, 0, Instant::at_us(0));
  CHECK(sender.is_due(Instant::at_us(0), false));
  CHECK(sender.is_due(Instant::at_us(1'000'000), false));
  CHECK_FALSE(sender.is_due(Instant::at_us(1'000'001), false));
  Matrix34d nowhere = T;
  nowhere(0, 3) = std::numeric_limits<double>::quiet_NaN();
  sender.note(T, 5, Instant::at_us(5));
  sender.note(nowhere, 6, Instant::at_us(6));
  CHECK_FALSE(sender.is_due(Instant::at_us(6), false));
  CHECK(sender.set_body(BodyBox{{-9, -1, -1}, {9, 1, 1}}) == Status::kOutOfRange);
  CHECK_FALSE(sender.body());
  sender.note(T, 7, Instant::at_us(7));
  CHECK_FALSE(sender.is_due(Instant::at_us(7), false));
}

TEST_CASE("presence: a robot that begins to move says so at once, and one that turns moves") {
  PresenceSender sender{ExchangeConfig{}};
  REQUIRE(sender.set_body(kBox) == Status::kOk);
  const auto write = [&](std::int64_t us) {
    Bytes bytes{};
    ByteWriter to(bytes);
    REQUIRE(sender.write(to, Instant::at_us(us)));
    ByteReader from(bytes);
    Presence said;
    REQUIRE(read_presence(from, said));
    return said;
  };
  Matrix34d T = Matrix34d::Identity();
  sender.note(T, 0, Instant::at_us(0));
  CHECK(write(0).speed_m_per_s == 0);
  T.leftCols<3>() = Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  sender.note(T, 120'000, Instant::at_us(120'000));
  CHECK(sender.is_due(Instant::at_us(120'000), false));
  const Presence turned = write(150'000);
  CHECK(turned.speed_m_per_s == 3);  // 2.56 m from the origin, 0.83 rad/s
  CHECK(turned.age_ms == 28);
  CHECK(turned.stamp_ms == 120);
}

}  // namespace tessera
