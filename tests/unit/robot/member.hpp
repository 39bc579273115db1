// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "network/toy_signatures.hpp"
#include "small_team.hpp"

namespace tessera {

/// A robot with its keys.
struct Member {
  Member(const RobotConfig& config, bool signs)
      : key(config.exchange.robot),
        one(config, {.authenticator = crc_authenticator(),
                     .signatures = signs ? key.signatures() : Signatures{}}) {}
  [[nodiscard]] Robot& robot() const { return *one.robot; }
  [[nodiscard]] MapSessions& sessions() const { return one.robot->sharer().sessions(); }
  network::ToySignatures key;
  SmallRobotMemory one;
};

}  // namespace tessera
