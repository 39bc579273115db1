// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The robots that said lately where they are. Bounded, and by this robot's clock alone: what one
// says is used for as long as it is fresh, and who is not heard any more is an obstacle like any
// other.
#pragma once

#include <span>

#include "tessera/base/arena.hpp"
#include "tessera/base/instant.hpp"
#include "tessera/exchange/presence.hpp"

namespace tessera {

/// A robot that was heard.
struct Teammate {
  std::uint32_t robot = 0;
  std::uint64_t session = 0;  ///< Of the process that said it.
  Presence presence{};        ///< The latest.
  Instant heard;
  Point3d velocity = Point3d::Zero();  ///< Metres a second, global frame, by what it said.
};

/// Where one is taken to be, in a frame of whoever asks.
struct TeammatePlace {
  /// However fast one is, and however long ago it was heard.
  static constexpr double kMostMargin_m = 1.5;

  std::uint32_t robot = 0;
  Matrix34d T_map_body = Matrix34d::Identity();  ///< At that time.
  Point3d velocity = Point3d::Zero();            ///< Metres a second, in the same frame.
  BodyBox box{};                                 ///< As it said, in its body's frame.
  double margin_m = 0.0;                         ///< By how much it may be elsewhere.
  std::uint8_t speed_m_per_s = 0;                ///< As it said; 0: it stands.
  Instant time;
  Instant until;  ///< After that it is no teammate any more, if nothing else is heard.

  /// The same at another time, of 1.5 s at most before or after. O(1).
  [[nodiscard]] TeammatePlace at(Instant other) const noexcept;
  /// Its box, with the margin on all sides. O(1).
  [[nodiscard]] PlacedBox placed_box() const noexcept;
};

class Teammates {
 public:
  /// What is older says nothing: it is missed ten times of a robot that moves, three of one that
  /// stands.
  static constexpr Duration kMovingFresh{1'000'000};
  static constexpr Duration kStandingFresh{3'000'000};
  static constexpr std::uint32_t kMost = 64;

  [[nodiscard]] static constexpr std::size_t required_bytes(std::uint32_t most) noexcept {
    return arena_bytes<Teammate>(most);
  }
  /// Of so many robots at most, in the order of their numbers. Fails with kResourceExhausted iff
  /// the arena is too small.
  [[nodiscard]] static Result<Teammates> make(Arena& arena, std::uint32_t most) noexcept;
  Teammates() noexcept = default;

  /// What a robot says of itself now. False, and nothing is changed: the box is not plausible
  /// (Presence), the stamp is before the latest one of that session, or the table is full of robots
  /// that are here. O(robots).
  [[nodiscard]] bool hear(std::uint32_t robot, std::uint64_t session, const Presence& presence,
                          Instant now) noexcept;
  /// It is here no more. O(robots).
  void forget(std::uint32_t robot) noexcept;
  /// It was heard lately.
  [[nodiscard]] static bool is_here(const Teammate& one, Instant now) noexcept;
  [[nodiscard]] std::span<const Teammate> all() const noexcept { return all_.first(count_); }
  /// Those that are here. O(robots).
  [[nodiscard]] std::size_t count(Instant now) const noexcept;
  /// Where the one at this place of them is now, in the global frame. margin_m: of frames and
  /// bodies. Fails with kOutOfRange iff there are not so many. O(robots).
  [[nodiscard]] Result<TeammatePlace> at(std::size_t index, double margin_m,
                                         Instant now) const noexcept;

 private:
  [[nodiscard]] Teammate* place_for(std::uint32_t robot, Instant now) noexcept;

  std::span<Teammate> all_;
  std::size_t count_ = 0;
};

}  // namespace tessera
