// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <tessera_status.hpp>

#include "fuzz/sensor_seeds.hpp"
#include "link/status_publisher.hpp"
#include "network/toy_signatures.hpp"
#include "support/random.hpp"

namespace tessera::fuzz {
namespace {

using Seed = std::vector<std::byte>;

void add(Seed& seed, unsigned value) { seed.push_back(static_cast<std::byte>(value & 0xffU)); }

/// fleet: bit 0: it has a key; bit 1: it signs.
Seed sealed_by(unsigned fleet, std::uint32_t robot) {
  network::ToySignatures key(robot);
  const StatusKeys keys{(fleet & 1U) != 0 ? crc_authenticator() : Authenticator{},
                        (fleet & 2U) != 0 ? key.signatures() : Signatures{}};
  Seed status(keys.status_bytes());
  tessera_status message{};
  message.version = kStatusVersion;
  message.robot = static_cast<std::int32_t>(robot);
  static_cast<void>(message.encode(status.data(), 0, static_cast<int>(kTypedStatusBytes)));
  seal_status(status, std::uint64_t{3} << 32U, 7, keys);
  return status;
}

}  // namespace

std::vector<std::vector<std::byte>> status_seeds() {
  std::vector<Seed> seeds;
  for (unsigned fleet = 0; fleet < 8; ++fleet) {
    // As it is, of another robot and of this one, and again.
    Seed heard;
    add(heard, fleet);
    for (const std::uint32_t robot : {2U, 1U, 2U}) {
      const Seed status = sealed_by(fleet, robot);
      add(heard, 0);
      add(heard, static_cast<unsigned>(status.size()));
      add(heard, static_cast<unsigned>(status.size() >> 8U));
      heard.insert(heard.end(), status.begin(), status.end());
    }
    seeds.push_back(heard);
    // More robots than have a place, before and after others were silent for long.
    Seed crowds;
    add(crowds, fleet);
    for (int i = 0; i < 3; ++i) {
      for (const unsigned value : {3U, 40U * static_cast<unsigned>(i), 60U, 1U, 4U, 0xbfU})
        add(crowds, value);
    }
    seeds.push_back(crowds);
    // Steps drawn at random.
    oracle::Random random(fleet);
    for (int i = 0; i < 4; ++i) {
      Seed program;
      add(program, fleet);
      for (int steps = 10 + random.below(60); steps > 0; --steps) {
        constexpr std::array<unsigned, 6> kSteps{1, 1, 1, 2, 2, 4};
        add(program, kSteps[static_cast<std::size_t>(random.below(6))]);
        for (int n = 4 + random.below(3); n > 0; --n) {
          const bool is_any = random.below(2) == 0;
          add(program, static_cast<unsigned>(random.below(is_any ? 256 : 4)));
        }
      }
      seeds.push_back(program);
    }
  }
  return seeds;
}

}  // namespace tessera::fuzz
