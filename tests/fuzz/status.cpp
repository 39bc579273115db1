// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Statuses of robots of the fleet, of those who have its key and lie, and of strangers. The tag and
// the signature are checked by this file's own reading of docs/reference/wire-format.md.
#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <string_view>
#include <tessera_status.hpp>
#include <tuple>
#include <utility>
#include <vector>

#include "fuzz/fuzz.hpp"
#include "link/status_publisher.hpp"
#include "link/status_table.hpp"
#include "network/toy_signatures.hpp"
#include "tessera/base/internal/byte_io.hpp"

namespace tessera::fuzz {

namespace {

using Status = std::vector<std::byte>;

constexpr std::uint32_t kOwn = 1;
constexpr std::size_t kMostKept = 16;
constexpr std::size_t kRobotAt = 12;
constexpr std::size_t kSessionAt = 436;
constexpr std::size_t kSignatureAt = 448;
static_assert(kSessionAt == kTypedStatusBytes);

std::uint32_t robot_of(Bytes status) {
  std::uint32_t robot = 0;
  for (std::size_t i = 0; i < 4; ++i)
    robot = robot << 8U | std::to_integer<std::uint32_t>(status[kRobotAt + i]);
  return robot;
}

/// Session and sequence.
using Order = std::pair<std::uint64_t, std::uint32_t>;
Order order_of(Bytes status) {
  ByteReader from(status.subspan(kSessionAt));
  const std::uint64_t session = from.u64();
  return {session, from.u32()};
}

Signature signature_by(std::uint32_t robot, Bytes status) {
  constexpr std::string_view kContext = "tessera 2 status";
  const Bytes context = std::as_bytes(std::span(kContext));
  Status message(context.begin(), context.end());
  message.insert(message.end(), status.begin(), status.begin() + kSignatureAt);
  network::ToySignatures key(robot);
  const Signatures by = key.signatures();
  Signature signature{};
  by.sign(by.context, message, signature);
  return signature;
}

std::uint64_t all_counted(const StatusTableReport& c) {
  return c.taken + c.refused_format + c.refused_tag + c.refused_robot + c.refused_replay +
         c.refused_rate + c.refused_signature + c.refused_places;
}

bool same(const StatusTable::Entry& a, const StatusTable::Entry& b) {
  const auto all = [](const StatusTable::Entry& e) {
    const HeardState& s = e.status;
    return std::make_tuple(e.heard_us, s.robot, s.epoch, s.session, s.sequence, s.exclude_digest,
                           s.own_twins, s.other_twins, s.conflicts);
  };
  return all(a) == all(b);
}

class Listener {
 public:
  explicit Listener(Bytes bytes) : input_(bytes) {}
  void run() {
    while (!input_.empty()) step();
  }

 private:
  void step() {
    switch (input_.below(5)) {
      case 0:
        return hear(input_.bytes(input_.u16() % 512));
      case 1:
        return say();
      case 2:
        return mutate();
      case 3:
        return crowd();
      default:
        const unsigned how = input_.u8();
        now_us_ += std::int64_t{how & 15U} << ((how >> 4U) * 2);
        return;
    }
  }

  /// A well-formed status, with what the fleet has behind it, of the robot or of one who lies.
  void say() {
    const unsigned how = input_.u8();
    tessera_status message{};
    message.version = (how & 0x80U) != 0 ? input_.u8() : kStatusVersion;
    message.robot = (how & 1U) != 0 ? static_cast<std::int32_t>(input_.u32()) : input_.u8();
    message.epoch = input_.u8();
    message.exclude_digest = (how & 2U) != 0 ? static_cast<std::int64_t>(input_.u32()) << 8U : 0;
    std::fill(std::begin(message.counters), std::end(message.counters),
              (how & 4U) != 0 ? -std::int64_t{input_.u8()} : 0);
    const std::uint64_t session = std::uint64_t{input_.u8() & 7U} << 32U;
    const std::uint32_t sequence = (how & 8U) != 0 ? input_.u32() : input_.u8();
    const auto named = static_cast<std::uint32_t>(message.robot);
    hear(kept(sealed(message, session, sequence, (how & 0x10U) != 0 ? named + 1 : named)));
  }
  /// Many robots, each once.
  void crowd() {
    const unsigned first = input_.u8();
    const unsigned count = input_.u8();
    const std::uint64_t session = input_.u8();
    for (unsigned robot = first; robot < first + count; ++robot) {
      tessera_status message{};
      message.version = kStatusVersion;
      message.robot = static_cast<std::int32_t>(robot);
      hear(sealed(message, session, ++sequence_, robot));
    }
  }
  /// One that was said, again: as it was or changed, signed and tagged anew or not.
  void mutate() {
    const unsigned how = input_.u8();
    if (kept_.empty()) return;
    Status status = kept_[input_.u8() % kept_.size()];
    if ((how & 1U) != 0) status.resize(std::min<std::size_t>(status.size() + 1, input_.u16()));
    for (unsigned change = how >> 4U; change > 0 && !status.empty(); --change)
      status[input_.u16() % status.size()] = static_cast<std::byte>(input_.u8());
    const bool is_whole = status.size() == keys_.status_bytes();
    if ((how & 2U) != 0 && is_whole) {
      const auto [session, sequence] = order_of(status);
      seal(status, session, sequence, robot_of(status));
    }
    if ((how & 4U) != 0 && is_whole && keys_.has_tag()) {
      const std::span<std::byte> all(status);
      keys_.authenticator.tag(nullptr, all.first(all.size() - kTagBytes), all.last<kTagBytes>());
    }
    hear(status);
  }

  const Status& kept(Status status) {
    if (kept_.size() == kMostKept) kept_.erase(kept_.begin());
    return kept_.emplace_back(std::move(status));
  }
  Status sealed(const tessera_status& message, std::uint64_t session, std::uint32_t sequence,
                std::uint32_t signer) const {
    Status status(keys_.status_bytes());
    const int typed = message.encode(status.data(), 0, static_cast<int>(kTypedStatusBytes));
    require(typed == static_cast<int>(kTypedStatusBytes), "a typed status of another size");
    seal(status, session, sequence, signer);
    return status;
  }
  void seal(Status& status, std::uint64_t session, std::uint32_t sequence,
            std::uint32_t signer) const {
    network::ToySignatures key(signer);
    StatusKeys keys = keys_;
    if (keys.signatures.on()) keys.signatures = key.signatures();
    seal_status(status, session, sequence, keys);
  }

  [[nodiscard]] bool has_right_tag(Bytes status) const {
    return !keys_.has_tag() ||
           keys_.authenticator.check(nullptr, status.first(status.size() - kTagBytes),
                                     status.last<kTagBytes>());
  }
  [[nodiscard]] bool has_right_signature(Bytes status) const {
    if (!keys_.signatures.on()) return true;
    const Signature wanted = signature_by(robot_of(status), status);
    return std::equal(wanted.begin(), wanted.end(), status.begin() + kSignatureAt);
  }

  void hear(Bytes status) {
    const StatusTableReport before = table_.counters();
    const std::vector<StatusTable::Entry> entries(table_.entries().begin(), table_.entries().end());
    const PayloadVerdict verdict = table_.hear(status, now_us_);
    const StatusTableReport& after = table_.counters();
    require(all_counted(after) == all_counted(before) + 1, "not counted once");
    const bool taken = after.taken != before.taken;
    require(taken == (verdict == PayloadVerdict::kTaken), "a verdict that is not the counter's");
    require((after.refused_format != before.refused_format) == (verdict == PayloadVerdict::kFormat),
            "format");
    require(judge_status(status, keys_) == verdict || verdict == PayloadVerdict::kExcluded ||
                after.refused_signature != before.refused_signature,
            "judged otherwise alone");
    const auto now = table_.entries();
    if (!taken) {
      require(
          now.size() == entries.size() && std::equal(now.begin(), now.end(), entries.begin(), same),
          "what is refused changes the table");
      return check_refused(status, before);
    }
    check_taken(status, entries);
  }

  void check_taken(Bytes status, const std::vector<StatusTable::Entry>& before) {
    require(status.size() == keys_.status_bytes(), "taken in another size");
    require(has_right_tag(status), "taken without a tag");
    require(has_right_signature(status), "taken without a signature");
    const std::uint32_t robot = robot_of(status);
    require(!own_ || robot != *own_, "taken of this robot");
    for (const StatusTable::Entry& entry : before) {
      const bool is_lately = now_us_ - entry.heard_us <= 5'000'000;
      const Order order{entry.status.session, entry.status.sequence};
      require(entry.status.robot != robot || order < order_of(status) ||
                  (!keys_.signatures.on() && !is_lately),
              "an older one is taken");
    }
    std::map<std::uint32_t, int> robots;
    for (const StatusTable::Entry& entry : table_.entries()) {
      require(++robots[entry.status.robot] == 1, "a robot has two places");
      if (entry.status.robot != robot) continue;
      require(Order(entry.status.session, entry.status.sequence) == order_of(status) &&
                  entry.heard_us == now_us_,
              "it is another one that was taken");
    }
    require(robots.count(robot) == 1 && robots.size() <= StatusTable::kMostRobots, "places");
    // There is one way to write it.
    tessera_status message{};
    const int typed = message.decode(status.data(), 0, static_cast<int>(kTypedStatusBytes));
    require(typed == static_cast<int>(kTypedStatusBytes), "taken, and not to be decoded");
    const auto [session, sequence] = order_of(status);
    const Status again = sealed(message, session, sequence, robot);
    require(std::equal(again.begin(), again.end(), status.begin(), status.end()), "not canonical");
  }

  /// Of what is right in all, something is short.
  void check_refused(Bytes status, const StatusTableReport& before) {
    const StatusTableReport& after = table_.counters();
    if (after.refused_rate != before.refused_rate)
      require(keys_.signatures.on(), "a limit of checks without checks");
    if (after.refused_places != before.refused_places)
      require(table_.entries().size() == StatusTable::kMostRobots, "no place among free ones");
    if (after.refused_tag != before.refused_tag)
      require(!has_right_tag(status), "a right tag is refused");
    if (after.refused_signature != before.refused_signature)
      require(!has_right_signature(status), "a right signature is refused");
    if (after.refused_robot != before.refused_robot)
      require(own_ == robot_of(status), "another robot is taken for this one");
  }

  Input input_;
  unsigned fleet_{input_.u8()};  ///< Bit 0: has a key; bit 1: signs; bit 2: of no robot.
  network::ToySignatures key_{kOwn};
  StatusKeys keys_{(fleet_ & 1U) != 0 ? crc_authenticator() : Authenticator{},
                   (fleet_ & 2U) != 0 ? key_.signatures() : Signatures{}};
  std::optional<std::uint32_t> own_{(fleet_ & 4U) != 0 ? std::nullopt
                                                       : std::optional<std::uint32_t>{kOwn}};
  StatusTable table_{keys_, own_};
  std::int64_t now_us_ = 0;
  std::uint32_t sequence_ = 0;
  std::vector<Status> kept_;
};

}  // namespace

void status(Bytes bytes) { Listener(bytes).run(); }

}  // namespace tessera::fuzz
