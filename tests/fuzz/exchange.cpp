// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/exchange.hpp"

#include <algorithm>
#include <array>
#include <cstring>

#include "fuzz/forged_signature.hpp"
#include "fuzz/small_robot.hpp"
#include "tessera/base/internal/crc32.hpp"
#include "tessera/exchange/internal/answers.hpp"
#include "tessera/map/internal/packed_block.hpp"

namespace tessera::fuzz {

namespace {

constexpr std::uint32_t kNumber = 1;
constexpr std::uint32_t kFriend = 2;
constexpr std::uint32_t kSession = 5;
constexpr std::int64_t kMostTimeUs = std::int64_t{1} << 50U;
constexpr std::size_t kMostKept = 16;

/// Of what a robot published since it started: nobody else changes it.
std::uint64_t own_content(const SmallRobot& robot) {
  const Replicas& replicas = robot.replicas();
  const Result<Replicas::Slot> slot = replicas.find({kNumber, kSession, 0});
  require(slot.ok(), "its own contribution is gone");
  static std::array<std::byte, most_packed_bytes(network::kClasses + 2)> bytes;
  std::uint64_t sum = replicas.contribution(*slot).frame_revision;
  for (std::uint32_t at = replicas.contribution(*slot).first_block; at != 0;
       at = replicas.record(at).next) {
    const Replicas::Replica& part = replicas.record(at);
    if (part.live == 0) continue;
    sum += mix64(part.key + mix64(part.version + (std::uint64_t{part.live} << 32U) +
                                  crc32c(replicas.read(part, bytes))));
  }
  return sum;
}

/// One robot, what it does, and what must hold meanwhile.
class Victim {
 public:
  Victim(bool has_map, bool with_signatures)
      : with_signatures_(with_signatures), robot_(kNumber, kSession, has_map, with_signatures) {
    sent();
  }

  [[nodiscard]] std::int64_t now_us() const { return now_us_; }
  void wait(std::int64_t us) { now_us_ = std::min(now_us_ + us, kMostTimeUs); }

  void publish(BlockKey key, std::uint64_t seed, int voxels) {
    oracle::Random random(seed);
    const Result<std::uint32_t> bytes = robot_.publish(key, random, voxels);
    require(bytes.ok() || bytes.status() == Status::kResourceExhausted, "publish");
    own_ = own_content(robot_);
  }
  void move(double x) {
    Matrix34d T_global_map = Matrix34d::Identity();
    T_global_map(0, 3) = x;
    require(exchange().move(kSession, 0, T_global_map) == Status::kOk, "move");
    own_ = own_content(robot_);
  }
  void exclude(std::uint32_t robot) {
    const Status status = exchange().exclude(robot);
    require((status == Status::kInvalidArgument) == (robot == kNumber), "exclude");
  }
  void leave() { exchange().leave(); }
  /// A move of its own is complete only when the map shows it.
  void fuse() {
    robot_.fuse();
    own_ = own_content(robot_);
  }

  /// What it sends next, if anything.
  Datagram sent() {
    Datagram datagram(kMostDatagramBytes);
    datagram.resize(exchange().send(now_us_, datagram));
    sent_bytes_ += static_cast<std::int64_t>(datagram.size());
    if (datagram.empty()) return datagram;
    require(is_sealed(datagram), "what is sent has no tag");
    ByteReader reader(datagram);
    DatagramHeader header;
    require(read_header(reader, header) && header.sender == kNumber, "what is sent has no header");
    require(header.is_signed == with_signatures_, "what is sent is of the other kind of fleet");
    if (with_signatures_) require(has_right_signatures(datagram), "what is sent is not signed");
    configuration_ = header.configuration;
    const double budget = SmallRobot::kExchange.burst_bytes +
                          static_cast<double>(now_us_) * 1e-6 *
                              static_cast<double>(SmallRobot::kExchange.bytes_per_s);
    require(static_cast<double>(sent_bytes_) <= budget + 1.0, "more is sent than the budget");
    return datagram;
  }

  void hear(Bytes datagram) {
    const ExchangeReport before = exchange().report();
    const bool has_key = is_sealed(datagram);
    const bool is_forged = has_key && with_signatures_ && has_no_signature(datagram);
    const std::uint64_t held = is_forged ? exchange().digest() : 0;
    if (!has_key) keep_state();
    exchange().receive(datagram, now_us_);
    const ExchangeReport after = exchange().report();
    require(after.received == before.received + 1, "not counted");
    require(after.received_bytes == before.received_bytes + datagram.size(), "bytes not counted");
    const std::uint64_t refused = refusals(after) - refusals(before);
    require(refused <= 1, "refused twice");
    require(has_key || refused == 1, "heard without a key");
    if (!has_key) check_state();
    require(!is_forged || exchange().digest() == held, "what nobody signed changes what is held");
    require(own_content(robot_) == own_, "its own contribution is changed by what is heard");
    const ReplicasUsage usage = robot_.replicas().usage();
    require(usage.segments <= SmallRobot::kReplicas.segments &&
                usage.replica_blocks <= SmallRobot::kReplicas.blocks &&
                after.contributions <= SmallRobot::kExchange.contributions &&
                after.peers <= SmallRobot::kExchange.peers &&
                after.waiting_answers <= Answers::most_waiting(SmallRobot::kExchange),
            "more is kept than there may be");
  }

  [[nodiscard]] std::uint32_t configuration() const { return configuration_; }

 private:
  Exchange& exchange() { return robot_.exchange(); }
  static bool has_right_signatures(const Datagram& datagram) {
    Datagram again = datagram;
    sign(again);
    return again == datagram;
  }
  /// Not one signature that is right.
  static bool has_no_signature(Bytes datagram) {
    Datagram copy(datagram.begin(), datagram.end());
    return sign(copy) == 0;
  }
  /// From run to run: fresh memory costs more than what is checked.
  static std::vector<std::byte>& kept_memory() {
    static std::vector<std::byte> memory;
    return memory;
  }
  void keep_state() {
    std::memcpy(object_.data(), &exchange(), sizeof(Exchange));
    kept_memory().assign(robot_.memory().begin(), robot_.memory().end());
  }
  /// Of all that a robot knows, three counters.
  void check_state() {
    constexpr std::size_t kWord = sizeof(std::uint64_t);
    const auto* const now = reinterpret_cast<const std::byte*>(&exchange());
    int changed = 0;
    for (std::size_t at = 0; at < sizeof(Exchange); at += kWord)
      changed += std::memcmp(now + at, object_.data() + at, kWord) != 0 ? 1 : 0;
    require(changed <= 3, "who has no key changes the exchange");
    require(std::memcmp(kept_memory().data(), robot_.memory().data(), kept_memory().size()) == 0,
            "who has no key changes what is known");
  }

  bool with_signatures_;
  SmallRobot robot_;
  std::int64_t now_us_ = 0;
  std::int64_t sent_bytes_ = 0;
  std::uint64_t own_ = own_content(robot_);
  std::uint32_t configuration_ = 0;
  std::array<std::byte, sizeof(Exchange)> object_{};
};

BlockKey block_of(unsigned which) {
  const auto at = [which](unsigned shift) {
    return static_cast<std::int32_t>((which >> shift) & 3U) - 2;
  };
  return *pack({at(0), at(2), at(4)});
}

class Run {
 public:
  explicit Run(Bytes bytes) : input_(bytes) {}
  void run() {
    while (!input_.empty()) step();
    for (int i = 0; i < 50; ++i) {
      victim_.wait(100'000);
      if (i % 10 == 0) victim_.fuse();
      for (Datagram last = victim_.sent(); !last.empty(); last = victim_.sent()) {
      }
    }
  }

 private:
  void step() {
    switch (input_.below(9)) {
      case 0:
        return victim_.hear(input_.bytes(input_.u16() % 2048));
      case 1:
        return forge();
      case 2:
        return publish();
      case 3:
        return wait();
      case 4:
        return pass(victim_.sent(), false);
      case 5: {
        Datagram datagram(kMostDatagramBytes);
        datagram.resize(friend_.exchange().send(victim_.now_us(), datagram));
        return pass(std::move(datagram), true);
      }
      case 6:
        return mutate();
      case 8:
        return lie();
      default:
        return command();
    }
  }
  void forge() {
    const unsigned how = input_.u8();
    DatagramHeader header;
    header.kind = static_cast<DatagramKind>(how % 16 % (kMostKind + 1));
    header.configuration = victim_.configuration() + ((how & 0x40U) != 0 ? 1U : 0U);
    header.sender = input_.u8();
    header.session = std::uint64_t{input_.u8() & 7U} << 32U;
    header.sequence = (how & 0x80U) != 0 ? input_.u32() : ++sequence_;
    header.is_signed = with_signatures_ != ((how & 0x30U) == 0x30U);
    victim_.hear(forged(header, input_.bytes(input_.u16() % 2048)));
  }
  void lie() {
    const unsigned how = input_.u8();
    DatagramHeader header;
    header.kind = static_cast<DatagramKind>(1U + (how & 15U) % kMostKind);
    header.configuration = victim_.configuration();
    header.sender = how >> 5U;
    header.session = std::uint64_t{(how >> 4U) & 1U} << 32U;
    header.sequence = ++sequence_;
    header.is_signed = with_signatures_;
    victim_.hear(forged(header, drawn_body(input_, header.kind, with_signatures_)));
  }
  void publish() {
    const unsigned how = input_.u8();
    const BlockKey key = block_of(input_.u8());
    const std::uint64_t seed = input_.u16();
    // Mostly few; as many as take several parts are slow to make.
    const int voxels = how >= 0xf8U ? 1200 : static_cast<int>(how / 16);
    if ((how & 2U) != 0) return victim_.publish(key, seed, voxels);
    oracle::Random random(seed);
    static_cast<void>(friend_.publish(key, random, voxels));
  }
  void wait() {
    const unsigned how = input_.u8();
    victim_.wait(std::int64_t{how & 15U} << ((how >> 4U) * 2 + 8));
  }
  void pass(Datagram datagram, bool from_friend) {
    if (datagram.empty()) return;
    const unsigned how = input_.u8();
    if (from_friend && (how & 1U) == 0) victim_.hear(datagram);
    if (!from_friend && (how & 1U) == 0) friend_.exchange().receive(datagram, victim_.now_us());
    if (kept_.size() == kMostKept) kept_.erase(kept_.begin());
    kept_.push_back(std::move(datagram));
  }
  /// What was said once, again: as it was or changed, signed by those whom it then names or not,
  /// with the tag of one who has the key or not.
  void mutate() {
    const unsigned how = input_.u8();
    if (kept_.empty()) return;
    Datagram datagram = kept_[input_.u8() % kept_.size()];
    if ((how & 1U) != 0) datagram.resize(std::min<std::size_t>(datagram.size(), input_.u16()));
    if ((how & 2U) != 0 && datagram.size() >= kHeaderBytes) {
      ByteWriter sender{std::span<std::byte>(datagram).subspan(12, 20)};
      sender.u32(input_.u8());
      sender.u64(std::uint64_t{input_.u8() & 7U} << 32U);
      sender.u64(++sequence_);
    }
    for (unsigned change = how >> 4U; change > 0 && !datagram.empty(); --change) {
      const std::size_t at = input_.u16() % datagram.size();
      datagram[at] = static_cast<std::byte>(input_.u8());
    }
    if ((how & 8U) != 0 && with_signatures_) static_cast<void>(sign(datagram));
    if ((how & 4U) != 0) seal(datagram);
    victim_.hear(datagram);
  }
  void command() {
    const unsigned how = input_.u8();
    if (how % 4 == 0) victim_.exclude(input_.u8() & 7U);
    if (how % 4 == 1) victim_.move(static_cast<double>(input_.u16()));
    if (how % 4 == 2) (how & 4U) != 0 ? victim_.leave() : victim_.fuse();
    if (how % 4 != 3) return;
    Matrix34d moved = Matrix34d::Identity();
    moved(1, 3) = input_.u8();
    require(friend_.exchange().move(1, 0, moved) == Status::kOk, "move");
  }

  Input input_;
  unsigned fleet_{input_.u8()};
  bool with_signatures_{(fleet_ & 2U) != 0};
  Victim victim_{(fleet_ & 1U) != 0, with_signatures_};
  SmallRobot friend_{kFriend, 1, false, with_signatures_};
  std::vector<Datagram> kept_;
  std::uint32_t sequence_ = 1000;
};

}  // namespace

void exchange(Bytes bytes) { Run(bytes).run(); }

}  // namespace tessera::fuzz
