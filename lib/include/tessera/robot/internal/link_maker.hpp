// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Compares this robot's contribution with those of others, one at a time and in pieces, and states
// the links that it accepts.
#pragma once

#include <optional>
#include <span>

#include "tessera/base/instant.hpp"
#include "tessera/exchange/exchange.hpp"
#include "tessera/frames/frame_finder.hpp"
#include "tessera/frames/replica_sketch_source.hpp"
#include "tessera/fusion/global_map.hpp"
#include "tessera/robot/frames_config.hpp"
#include "tessera/robot/internal/team_placement.hpp"

namespace tessera {

/// What this robot has found about another one.
struct PairState {
  std::uint32_t robot = 0;
  std::uint32_t epoch = 0;      ///< Of its contribution that was compared.
  std::uint32_t own_epoch = 0;  ///< And of this robot's.
  std::uint32_t attempts = 0;
  FrameVerdict verdict = FrameVerdict::kTooLittle;  ///< Of the last attempt.
  bool stated = false;          ///< The link holds: it was accepted, and not withdrawn.
  std::uint32_t refusals = 0;   ///< Contradictions of a stated link since it was last confirmed.
  double support = 0.0;         ///< FrameAnswer, of the last attempt.
  double support_second = 0.0;  ///< Of the last search: a refinement looks for no other place.
  Agreement agreement{};
  Agreement agreement_second{};  ///< As support_second.
  double sigma_m = 0.0;
  double sigma_rad = 0.0;
  FrameLink link{};                         ///< As it was stated last, or is to be.
  bool waits = false;                       ///< To be stated.
  bool no_room = false;                     ///< When it was to be stated last.
  Instant state_due = Instant::long_ago();  ///< When that is tried again.
  /// What was compared, and what was found, while the link is stated.
  ContributionId own_id{};
  ContributionId other_id{};
  Matrix34d T_world_own = Matrix34d(Matrix34d::Identity());
  Matrix34d T_world_other = Matrix34d(Matrix34d::Identity());
  FrameAnswer answer{};
  Instant due = Instant::long_ago();
  /// Segments at the last attempt: of what a stated link is of, else of all that may be compared.
  std::uint64_t compared = 0;
  /// Without a link, maps of this robot and of the other one take turns.
  std::uint32_t combinations = 0;
  std::uint32_t turn = 0;
  bool is_wide = false;  ///< The next search is anywhere: the one before was near a guess.
  /// The last attempt that was no refinement.
  struct Search {
    std::uint64_t compared = 0;  ///< Segments of both.
    ContributionId own_id{};     ///< What was compared.
    ContributionId other_id{};
    std::uint32_t refinements = 0;  ///< Since then.
  } search{};
  bool in_doubt = false;  ///< A refinement did not find the link: it is searched for at once.
};

class LinkMaker {
 public:
  /// Blocks that a contribution must have to be compared.
  static constexpr std::uint32_t kLeastBlocks = 32;
  /// From one attempt to the next, at least: where nothing was found, and where a link is stated.
  static constexpr Duration kRetry{2'000'000};
  static constexpr Duration kRecheck{5'000'000};
  /// Statements of this robot, of any pair: one a second.
  static constexpr Duration kStatePause{1'000'000};
  /// A link is stated anew when it has moved by this much at the overlap, or was turned.
  static constexpr double kWorth_m = 0.03;
  static constexpr double kWorth_rad = 0.0017;
  /// A link from which a search ends this far off is in doubt.
  static constexpr double kElsewhere_m = 0.3;
  static constexpr double kElsewhere_rad = 0.0175;
  /// It is withdrawn after so many contradictions without a confirmation between them.
  static constexpr std::uint32_t kMostRefusals = 3;
  /// A link that is stated is refined where it is, and searched for near there where a refinement
  /// does not find it, where a search has found it elsewhere, after so many refinements, or where
  /// the maps have so many times what they had when it was searched for last.
  static constexpr std::uint32_t kMostRefinements = 8;
  static constexpr std::uint64_t kSearchGrowth = 2;

  [[nodiscard]] static constexpr std::size_t required_bytes(const FramesConfig& config,
                                                            const GlobalMapConfig& global,
                                                            int num_components) noexcept {
    return FrameFinder::required_bytes() +
           2 * ReplicaSketchSource::required_bytes(global.map, num_components, global.replicas) +
           arena_bytes<PairState>(config.most_robots);
  }
  /// Fails with kResourceExhausted iff the arena is too small.
  [[nodiscard]] Status set_up(Arena& arena, const FramesConfig& config,
                              const GlobalMapConfig& global, const ClassTable& classes) noexcept;
  LinkMaker() noexcept = default;

  /// Notes who is there, states a link that waits, and begins the next search, if one is due.
  /// O(contributions robots), and O(blocks) of two contributions where one begins.
  void tick(Exchange& exchange, const GlobalMap& global, const TeamPlacement& placement,
            Instant now) noexcept;
  /// The next piece of the search under way; false: there is none.
  bool step(Instant now) noexcept;

  [[nodiscard]] std::span<const PairState> pairs() const noexcept { return pairs_.first(count_); }
  /// A search is under way, or a link waits to be stated.
  [[nodiscard]] bool busy() const noexcept;

 private:
  /// A contribution that stands for a robot's map.
  struct Chosen {
    Replicas::Slot slot = 0;
    ContributionId id{};
    std::uint32_t segments = 0;  ///< What is held of it: later versions of a block say more.
  };
  struct Comparison {
    Chosen own{};
    Chosen other{};
    [[nodiscard]] std::uint64_t segments() const noexcept {
      return std::uint64_t{own.segments} + other.segments;
    }
  };
  /// A robot's maps of an epoch that may be compared.
  struct Maps {
    std::uint32_t count = 0;
    std::uint64_t segments = 0;
  };
  [[nodiscard]] static Chosen chosen(const Replicas& replicas, Replicas::Slot slot) noexcept;
  [[nodiscard]] static Maps maps_of(const Replicas& replicas, std::uint32_t robot,
                                    std::uint32_t epoch) noexcept;
  /// The newest of them is number 0. There must be one of this number.
  [[nodiscard]] static Chosen newest(const Replicas& replicas, std::uint32_t robot,
                                     std::uint32_t epoch, std::uint32_t number) noexcept;
  void note_robots(const TeamPlacement& placement, std::uint32_t own, std::uint32_t epoch) noexcept;
  /// A place for one more; null: all are of robots that are there, or one is compared.
  [[nodiscard]] PairState* place_for_pair(const TeamPlacement& placement) noexcept;
  /// Robots move submaps as their pose graphs have them: links between worlds follow at once, and
  /// so does what is compared.
  void follow_corrections(const GlobalMap& global) noexcept;
  /// Nothing: none is due.
  [[nodiscard]] static std::optional<Comparison> due(PairState& pair, const Replicas& replicas,
                                                     std::uint32_t own_robot, Instant now) noexcept;
  void begin(PairState& pair, const GlobalMap& global, const TeamPlacement& placement,
             const Comparison& comparison) noexcept;
  [[nodiscard]] FrameQuestion question(const PairState& pair,
                                       const TeamPlacement& placement) const noexcept;
  [[nodiscard]] bool is_refined(const PairState& pair) const noexcept;
  void take(PairState& pair, Instant now) noexcept;
  /// Whether the answer is where the link is, or there is no link.
  [[nodiscard]] bool is_where_stated(const PairState& pair) const noexcept;
  void accept(PairState& pair) noexcept;
  static void refuse(PairState& pair, FrameVerdict verdict) noexcept;
  /// The link of an answer as it is to be stated next.
  static void renew(PairState& pair, FrameLink link) noexcept;
  void state(Exchange& exchange, Instant now) noexcept;

  FramesConfig config_{};
  FrameFinder finder_;
  ReplicaSketchSource source_a_;
  ReplicaSketchSource source_b_;
  std::span<PairState> pairs_;
  std::size_t count_ = 0;
  std::optional<std::size_t> at_;  ///< The pair that is compared.
  bool refines_ = false;           ///< It is a refinement.
  bool is_near_ = false;           ///< It is searched for near a guess.
  bool is_of_link_ = false;        ///< It is compared what the stated link is of.
  Chosen own_{};
  Chosen other_{};
  Matrix34d T_world_a_ = Matrix34d(Matrix34d::Identity());  ///< Of what is compared.
  Matrix34d T_world_b_ = Matrix34d(Matrix34d::Identity());
  std::size_t next_ = 0;  ///< Pairs take turns.
  Instant stated_ = Instant::long_ago();
};

}  // namespace tessera
