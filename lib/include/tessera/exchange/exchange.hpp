// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Keeps the replicas of all robots the same over a network that loses, repeats, reorders and cuts:
// a state machine between datagrams and replicas, without sockets, clock or threads. Each record
// has a version of its own within its contribution. The origin of a contribution states what there
// is: the latest version, the number of records and their fingerprint. A robot that holds just that
// is complete; one that does not asks for versions, and where those are the same compares contents
// (docs/design/exchange.md).
//
// Gate decides who is listened to, MessageTaker takes what they say, Ledger joins it, Repair asks
// for what is lacking, Reach decides what is held, Sender sends under a budget.
#pragma once

#include "tessera/exchange/internal/message_taker.hpp"
#include "tessera/exchange/internal/reach.hpp"
#include "tessera/exchange/publication.hpp"
#include "tessera/exchange/teammates.hpp"
#include "tessera/frames/frame_statements.hpp"

namespace tessera {

class Exchange {
 public:
  [[nodiscard]] static constexpr std::size_t required_bytes(const ExchangeConfig& config,
                                                            int num_components) noexcept {
    return Gate::required_bytes(config) + Ledger::required_bytes(config, num_components) +
           Repair::required_bytes(config) + Sender::required_bytes(config) +
           MessageTaker::required_bytes() + Teammates::required_bytes(config.teammates);
  }
  /// Fails with kInvalidArgument iff a setting is out of its range, or config.records below the
  /// store's blocks; kResourceExhausted iff the arena is too small. What store, authenticator and
  /// signatures name must outlive it. With signatures nothing is taken that its origin did not
  /// sign, and a fleet has all of them or none.
  [[nodiscard]] static Result<Exchange> make(Arena& arena, const ExchangeConfig& config,
                                             const ReplicaStore& store,
                                             const Authenticator& authenticator,
                                             const ClassTable& classes,
                                             const Signatures& signatures = {}) noexcept;
  /// make() where it is to be, without a copy of it on the stack: for one that is unusable yet, and
  /// stays so where this fails.
  [[nodiscard, gnu::noinline]] Status set_up(Arena& arena, const ExchangeConfig& config,
                                             const ReplicaStore& store,
                                             const Authenticator& authenticator,
                                             const ClassTable& classes,
                                             const Signatures& signatures) noexcept;
  /// Unusable until one from make() is move-assigned, or set_up().
  Exchange() noexcept = default;

  // --- What this robot says ----------------------------------------------------------------------

  /// Starts a contribution of this robot's: what publish() is of from now on. The first one before
  /// anything is received: from then on nobody else says anything of that epoch. Fails with
  /// kInvalidArgument iff T_global_map is no frame (GridTransform::make), the epoch is below the
  /// robot's floor, the submap is no map's (is_map), or there is such a
  /// contribution; kResourceExhausted iff there is no place for it.
  [[nodiscard]] Status open(std::uint32_t epoch, std::uint32_t submap,
                            const Matrix34d& T_global_map) noexcept;
  /// Moves a contribution that open() started. Fails with kInvalidArgument iff there
  /// is none or it is no frame.
  [[nodiscard]] Status move(std::uint32_t epoch, std::uint32_t submap,
                            const Matrix34d& T_global_map) noexcept;
  /// Whether all of a submap of this robot's is held, of any epoch. O(contributions).
  [[nodiscard]] bool has_all_of(std::uint32_t submap) const noexcept;
  /// Starts a contribution beside the one that publish() is of, in its epoch: of a submap of an
  /// earlier start, which nobody has any more. Fails as open(), and with kInvalidArgument iff
  /// nothing is published yet, or its number is not below.
  [[nodiscard]] Status open_earlier(std::uint32_t submap, const Matrix34d& T_global_map) noexcept;
  /// Publishes a block of it, as publish(). Others ask for it: it is not fresh. Fails as publish(),
  /// and with kInvalidArgument iff it was not started.
  [[nodiscard]] Result<std::uint32_t> publish_earlier(std::uint32_t submap, BlockKey key,
                                                      const BlockContent& content) noexcept;
  /// Starts a session beside the contribution that publish() is of, in its epoch: a map of an
  /// earlier day. Its blocks are published by publish_earlier(). submap: from MapSession::kFirst
  /// on, and each once in an epoch. Fails as open(), and with kInvalidArgument iff nothing is
  /// published yet, it is no such number, or the weight is 0 or above MapSession::kFullWeight.
  [[nodiscard]] Status open_session(std::uint32_t submap, const MapSession& session,
                                    const Matrix34d& T_global_map) noexcept;
  /// A session of this epoch counts no more: its weight is 0 from now on. Its blocks stay where
  /// they are until they are published empty. Fails with kInvalidArgument iff there is none.
  [[nodiscard]] Status end_session(std::uint32_t submap) noexcept;
  /// Publishes an objection, in place of what was in its place. Others ask for it: it is not fresh.
  /// Returns the bytes on the wire. Fails with kInvalidArgument iff nothing is published yet; as
  /// open(), with the first; as publish(). O(1).
  [[nodiscard]] Result<std::uint32_t> object(const Objection& objection) noexcept;
  /// States a link of this robot's map to that of another robot, in place of what it stated of that
  /// one in this epoch. It counts as its bytes are (round_link), also for this robot; collect()
  /// gives it. Others ask for it: it is not fresh. Returns the bytes on the wire. Fails with
  /// kInvalidArgument iff nothing is published yet, the link is not from this robot or not of the
  /// epoch of publish(), or it has no code (encode_link); kResourceExhausted iff links to
  /// FrameStatements::kMostLinks others were stated in this epoch, there is no place for the
  /// contribution or no more versions; as ReplicaStore::put. O(1) but for opening the contribution
  /// with the first one: O(contributions).
  [[nodiscard]] Result<std::uint32_t> state(const FrameLink& link) noexcept;
  /// States how well the frame of this robot's contributions is known, in place of what it stated
  /// in this epoch. Fails in the same way; it has a place beside the links.
  [[nodiscard]] Result<std::uint32_t> state(const StatedPrior& prior) noexcept;
  /// States from now on that this robot's sessions of epochs below floor count no more: everybody
  /// removes them. Never lower than before, and at most the epoch of publish().
  void set_session_floor(std::uint32_t floor) noexcept;
  /// Places in which there may be a contribution, from 0. O(1).
  [[nodiscard]] std::uint32_t places() const noexcept {
    return static_cast<std::uint32_t>(ledger_.places().size());
  }
  /// The submap that an earlier epoch of this robot has in a place, as far as it is held. O(1).
  [[nodiscard]] std::optional<std::uint32_t> earlier_at(std::uint32_t place) const noexcept;
  /// Moves that: nobody else does. False: there is none, it is there already, or T_global_map is no
  /// frame. O(1).
  bool move_earlier(std::uint32_t place, const Matrix34d& T_global_map) noexcept;
  /// Publishes a block, quantised (block_codec.hpp), in as many parts as it takes: into this
  /// robot's own replicas, and to whom it may concern from the next send() on. Returns the bytes on
  /// the wire. Fails with kInvalidArgument iff no contribution was started; as ReplicaStore::put,
  /// and what was published before stays, as far as no part was taken. O(512 components).
  [[nodiscard]] Result<std::uint32_t> publish(BlockKey key, const BlockContent& content) noexcept;
  /// Adds what was last published of a block to content. False: nothing was, or an empty block.
  /// O(bytes).
  [[nodiscard]] bool read_published(BlockKey key, BlockContent& content) const noexcept {
    return ledger_.read_published(key, content);
  }
  /// Tells the others, with the next send(), that this robot sends no more.
  void leave() noexcept { sender_.leave(); }

  /// The contribution that publish() is of, if there is one.
  [[nodiscard]] std::optional<ContributionId> publishing() const noexcept {
    const Ledger::Contribution* const own = ledger_.publishing();
    return own == nullptr ? std::nullopt : std::optional(own->id);
  }

  // --- Epochs ------------------------------------------------------------------------------------

  /// States from now on that this robot's epochs below floor count no more: everybody removes them.
  /// For the start, before open(); never lower than before. Ends contributions of this process that
  /// are below it.
  void set_floor(std::uint32_t floor) noexcept;
  /// A floor of another robot that was heard before this process started: what is below it is a
  /// recording. Ignored iff it is this robot's.
  void set_floor_of(std::uint32_t robot, std::uint32_t floor) noexcept;
  /// Something else was published in this robot's name than by this process, in this epoch or a
  /// later one: by a process before it whose counter was lost, or by another one that has this
  /// robot's number. What is published from now on must be in an epoch above this: set_floor() and
  /// open() with a higher one, and everything is published anew.
  [[nodiscard]] std::optional<std::uint32_t> overtaken() const noexcept {
    return ledger_.floors().overtaken();
  }
  /// Floors of other robots that were heard, to be kept for the next start, and what was heard in
  /// this robot's name.
  [[nodiscard]] const EpochFloors& epochs() const noexcept { return ledger_.floors(); }

  // --- Robots that are not listened to -----------------------------------------------------------

  /// Takes all of a robot out of the replicas, and hears it no more. Fails with kInvalidArgument
  /// iff it is this robot; kResourceExhausted iff kMostExcluded are excluded.
  [[nodiscard]] Status exclude(std::uint32_t robot) noexcept;
  /// Hears it again. What it has published comes back as a newcomer gets it.
  void include(std::uint32_t robot) noexcept { gate_.include(robot); }
  /// Ascending.
  [[nodiscard]] std::span<const std::uint32_t> excluded() const noexcept {
    return gate_.excluded();
  }

  // --- Where robots are --------------------------------------------------------------------------

  /// How large this robot is, in its body's frame; nothing: it does not say where it is, as at
  /// first. Fails with kOutOfRange iff others would not take it (Presence::is_sendable): then it
  /// says nothing.
  [[nodiscard]] Status set_body(const std::optional<BodyBox>& box) noexcept {
    return sender_.presence().set_body(box);
  }
  /// Where this robot was at now_us, on the clock of send(): sent ten times a second while it
  /// moves, once while it stands, and no more where nothing newer was noted for a second.
  /// stamp_us: the same on the clock of its poses, from 0. O(1).
  void note_place(const Matrix34d& T_global_body, std::int64_t stamp_us,
                  std::int64_t now_us) noexcept {
    sender_.presence().note(T_global_body, stamp_us, Instant::at_us(now_us));
  }
  /// What the others say of theirs.
  [[nodiscard]] const Teammates& teammates() const noexcept { return teammates_; }

  // --- What is held ------------------------------------------------------------------------------

  /// Around which places what others publish is to be held, in the global frame; at most
  /// PlacesOfInterest::kMost. Contributions that have no block within radius_m of any are dropped
  /// when room or places are short, the farthest first and whole, and are asked for again once a
  /// place comes near. Without places, or with ExchangeConfig::far_contributions 0, all that is
  /// known is held as far as there is room. This robot's own are held in any case. O(1).
  void set_reach(std::span<const Point3d> p_global, double radius_m) noexcept {
    reach_.set(p_global, radius_m);
  }

  // --- Datagrams ---------------------------------------------------------------------------------

  /// What arrived: any bytes at all. now_us: monotonic. Work: the tag's, and for each record that
  /// is news decoding and a put; for each request a walk over the coverage.
  void receive(std::span<const std::byte> datagram, std::int64_t now_us) noexcept;
  /// The next datagram to send to all, in into, of at least kMostDatagramBytes. Returns its size: 0
  /// iff nothing is due or the budget of bytes is used up; then ask again at the next tick. Work: a
  /// walk over one contribution's records, or over a bucket of its index for each span asked for.
  [[nodiscard]] std::size_t send(std::int64_t now_us, std::span<std::byte> into) noexcept;

  // --- How things stand --------------------------------------------------------------------------

  /// Counters never decrease. O(contributions).
  [[nodiscard]] ExchangeReport report() const noexcept;
  /// Of each contribution that report() counts, as far as into goes; returns how many there are.
  [[nodiscard]] std::size_t contributions(std::span<ContributionState> into) const noexcept;
  /// The one at this place of them. Fails with kOutOfRange iff there are not so many.
  [[nodiscard]] Result<ContributionState> contribution_at(std::size_t index) const noexcept;
  [[nodiscard]] const PeerTable& peers() const noexcept { return gate_.peers(); }
  /// The proofs of conflicts that this robot has, in the order in which they came.
  [[nodiscard]] const Conflicts& conflicts() const noexcept { return ledger_.conflicts(); }
  /// What this robot and its peers must have in common.
  [[nodiscard]] const ConfigurationDetails& configuration() const noexcept {
    return gate_.details();
  }
  /// Robots that announced lately that they hold, complete, what this robot publishes, and nothing
  /// else than this robot. O(peers + contributions).
  [[nodiscard]] std::uint32_t peers_agreeing(std::int64_t now_us) const noexcept;
  /// Of all that is there: equal on robots that hold the same records in the same frames.
  /// O(contributions).
  [[nodiscard]] std::uint64_t digest() const noexcept { return ledger_.digest(); }

 private:
  [[nodiscard]] bool is_listening(Instant now) noexcept;
  void owe_own(std::uint32_t submap) noexcept;
  void owe_latest(std::uint32_t submap) noexcept;
  [[nodiscard]] Result<std::uint32_t> state(BlockKey place,
                                            std::span<const std::byte> statement) noexcept;
  void hear_presence(const Heard& heard) noexcept;

  std::uint32_t robot_ = 0;
  Duration listen_{};
  Instant started_;  ///< At the first call of receive() or send().
  Gate gate_{};
  Ledger ledger_{};
  Repair repair_{};
  Reach reach_{};
  Sender sender_{};
  MessageTaker messages_{};
  Teammates teammates_{};
  ExchangeReport counted_{};
};

}  // namespace tessera
