// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A robot that has loaded two maps of earlier days, and removes one of them again; and one whose
// submaps are moved; and one that says where it is.
#pragma once

#include <stdexcept>

#include "network/simulated_network.hpp"
#include "support/team.hpp"
#include "tessera/base/rigid_code.hpp"

namespace tessera::exchange_tests {

/// A robot drives along x, and says so.
inline void note_place(Exchange& exchange, std::int64_t now_us) {
  if (exchange.report().presences == 0 &&
      exchange.set_body(BodyBox{{-1, -0.5F, 0}, {1, 0.5F, 3}}) != Status::kOk)
    throw std::runtime_error("a body");
  Matrix34d T = Matrix34d::Identity();
  T(0, 3) = 1e-6 * static_cast<double>(now_us);
  exchange.note_place(T, now_us, now_us);
}

/// Against blocks that others have, and against one that nobody has; one of them is said anew.
inline void publish_objections(Exchange& exchange, oracle::Random& random) {
  for (std::int32_t i = 0; i < 7; ++i) {
    Objection one{.against = {1, 2, 0},
                  .key = *pack(BlockCoord{i % 6 - 3, 1, -i}),
                  .version = static_cast<std::uint32_t>(i)};
    for (int voxels = 1 + 40 * i; voxels > 0; --voxels)
      add_row(one.voxels, random.below(kBlockVoxels));
    if (!exchange.object(one).ok()) throw std::runtime_error("an objection");
    one.version += 1000;
    if (i == 3 && !exchange.object(one).ok()) throw std::runtime_error("an objection");
  }
}

/// Links to robots near and far in number, one of them stated anew, and a prior.
inline void publish_frame_statements(Exchange& exchange, oracle::Random& random) {
  const ContributionId own = *exchange.publishing();
  StatedPrior prior{.robot = own.robot, .epoch = own.epoch};
  prior.covariance = FrameCovariance::isotropic({12.5, -3.0, 0.25}, 0.4, 0.02);
  prior.covariance.values[FrameCovariance::index(4, 0)] = -0.001;
  bool done = exchange.state(prior).ok();
  prior.kind = PriorKind::kVague;
  done = done && exchange.state(prior).ok();
  std::uint32_t revision = 0;
  for (const std::uint32_t to : {7U, 0x12345678U, 0xffffffffU, 7U}) {
    FrameLink link{.from = own.robot, .to = to, .from_epoch = own.epoch, .revision = ++revision};
    link.T_from_to = *round_rigid(oracle::random_transform(random, 40.0, 30.0));
    link.withdrawn = to == 0xffffffffU;
    link.covariance = prior.covariance;
    done = done && exchange.state(link).ok();
  }
  if (!done) throw std::runtime_error("statements about frames");
}

/// Of another digest and date each; one lies before 1970. Objections too, and statements about
/// frames.
inline void publish_sessions(Exchange& exchange, oracle::Random& random) {
  AlignedMemory memory(BlockContent::required_bytes(network::kClasses + 2));
  Arena arena(memory.span());
  BlockContent content = *BlockContent::make(arena, network::kClasses + 2);
  for (const std::uint32_t number : {0U, 1U}) {
    const std::uint32_t submap = MapSession::kFirst + number;
    const MapSession session{0x0123456789abcdefU + number, number == 0 ? 1'764'115'200 : -1, 16384};
    bool done = exchange.open_session(submap, session, Matrix34d::Identity()) == Status::kOk;
    for (std::int32_t x = 0; x < 5; ++x) {
      content.clear();
      network::add_random_voxels(content, random, 20);
      done = done && exchange.publish_earlier(submap, *pack(BlockCoord{x, -7, 3}), content).ok();
    }
    if (!done) throw std::runtime_error("a session");
  }
  publish_objections(exchange, random);
  publish_frame_statements(exchange, random);
}

inline void remove_session(Exchange& exchange) {
  if (exchange.end_session(MapSession::kFirst + 1) != Status::kOk)
    throw std::runtime_error("the end of a session");
}

/// Two submaps at once: of one transform there is a short code, of the other none.
inline void move_submaps(Exchange& exchange) {
  Matrix34d tilted = Matrix34d::Identity();
  tilted << 0.36, 0.48, -0.8, -2.5, -0.8, 0.6, 0.0, 17.3, 0.48, 0.64, 0.6, 0.2;
  Matrix34d shifted = Matrix34d::Identity();
  shifted(1, 3) = 0.1;
  if (exchange.open(2, 1, *round_rigid(tilted)) != Status::kOk ||
      exchange.move(2, 0, shifted) != Status::kOk)
    throw std::runtime_error("moves");
}

}  // namespace tessera::exchange_tests
