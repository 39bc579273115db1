// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Two robots were told of the same versions of a contribution whose origin is gone, and hold
// different records. Until they are equal they send the records that differ, their proofs, 32 kB,
// and 256 B for each of them, in a few exchanges, wherever the differences lie.
#include <algorithm>
#include <catch2/catch.hpp>

#include "network/forger.hpp"
#include "network/simulated_network.hpp"

namespace tessera::network {
namespace {

constexpr std::int64_t kSecond = 1'000'000;
constexpr std::uint32_t kOrigin = 7;

ReplicasConfig large() {
  return {
      .segments = 1U << 19U, .blocks = 1U << 18U, .contributions = 16, .robot_segments = 1U << 19U};
}

ExchangeConfig fast() {
  ExchangeConfig config;
  config.bytes_per_s = 100'000'000;
  config.burst_bytes = 100'000'000;
  return config;
}

#if TESSERA_ASSERTS  // with sanitizers, which are slow
constexpr std::uint32_t kRecords = 10'000;
constexpr bool kIsSlow = true;
#else
constexpr std::uint32_t kRecords = 100'000;
constexpr bool kIsSlow = false;
#endif
/// So many that they are compared, and not asked for as what nobody has claimed yet.
constexpr std::uint32_t kSignedRecords = 100'000;

enum class Kind : std::uint8_t { kMissing, kOther };

/// What is different at robot 0 and at robot 1, by version.
struct Difference {
  std::uint32_t records = 0;
  std::vector<std::uint8_t> lacks;  ///< Bit i: robot i lacks it, or holds another content.
  Kind kind = Kind::kMissing;
  std::uint64_t proof_bytes = 0;  ///< Of the records that somebody lacks.
};

Difference drawn(oracle::Random& random, std::uint32_t records, std::uint32_t k, bool in_one_run,
                 Kind kind) {
  Difference difference{records, std::vector<std::uint8_t>(records + 1, 0), kind, 0};
  const auto below = [&](std::uint32_t most) {
    return static_cast<std::uint32_t>(random.below(static_cast<int>(most)));
  };
  const auto whom = [&] { return static_cast<std::uint8_t>(1 + below(2)); };
  const std::uint32_t first = 1 + below(records - k + 1);
  for (std::uint32_t i = 0; in_one_run && i < k; ++i) difference.lacks[first + i] = 1;
  for (std::uint32_t i = 0; !in_one_run && i < k;) {
    std::uint8_t& lacks = difference.lacks[1 + below(records)];
    i += lacks == 0 ? 1U : 0U;
    if (lacks == 0) lacks = whom();
  }
  return difference;
}

/// A chunk as one robot gets it: without the records that it lacks, or with others.
std::vector<std::byte> changed_for(int robot, const std::vector<std::byte>& datagram,
                                   Difference& difference) {
  const std::span<const std::byte> all(datagram);
  ByteReader from(all.subspan(kHeaderBytes, all.size() - kHeaderBytes - kTagBytes));
  ChunkHeader header;
  DatagramHeader outer;
  ByteReader begin(all);
  REQUIRE(read_header(begin, outer));
  REQUIRE(read_chunk_header(from, outer.session, header));
  std::vector<std::byte> changed(kMostDatagramBytes);
  ByteWriter to(changed);
  write_header(to, outer);
  write_chunk_header(to, header);
  RecordReader records(from, header.range, header.relayed && outer.is_signed);
  RecordWriter writer(to, header.range);
  ChunkRecord record;
  while (from.remaining() != 0) {
    REQUIRE(records.read(record));
    const bool lacks = (difference.lacks[record.version.number] >> robot & 1) != 0;
    if (lacks) difference.proof_bytes += record.proof.size();
    if (lacks && difference.kind == Kind::kMissing) continue;
    if (lacks) record.coded = {};
    REQUIRE(writer.write(record));
  }
  changed.resize(to.size() + kTagBytes);
  Forger::seal(changed);
  return changed;
}

bool is_chunk(const std::vector<std::byte>& datagram) {
  return (datagram[3] & std::byte{0x7f}) == static_cast<std::byte>(DatagramKind::kChunk);
}

void tell(Network& network, const std::vector<std::byte>& said, Difference& difference) {
  for (const int i : {0, 1})
    network.robot(i).exchange().receive(is_chunk(said) ? changed_for(i, said, difference) : said,
                                        Network::clock_us(i, network.now_us()));
}

template <class Hear>
void publish_all(Robot& origin, Network& network, std::uint32_t records, const Hear& hear) {
  std::vector<std::byte> datagram(kMostDatagramBytes);
  for (std::uint32_t version = 1; version <= records; ++version) {
    const auto at = static_cast<std::int32_t>(version);
    REQUIRE(origin.publish(*pack({at % 64, at / 64 % 64, at / 4096}), network.random(), 3).ok());
    if (version % 1000 != 0 && version != records) continue;
    while (const std::size_t size = origin.exchange().send(0, datagram))
      hear(std::vector<std::byte>(datagram.begin(),
                                  datagram.begin() + static_cast<std::ptrdiff_t>(size)));
  }
}

/// The origin publishes all records, and both robots hear what they are to hear of it.
void teach(Network& network, Difference& difference) {
  Robot origin(kOrigin, 1, large(), fast());
  publish_all(origin, network, difference.records,
              [&](const std::vector<std::byte>& said) { tell(network, said, difference); });
}

/// The same where robots sign. What an origin sends is signed as a whole, so a third robot passes
/// on records with their proofs, and leaves out some.
void teach_signed(Network& network, Difference& difference) {
  constexpr std::uint32_t kRelay = 8;
  constexpr std::uint32_t kAsker = 9;
  Robot origin(kOrigin, 1, large(), fast(), {.key = kOrigin});
  Robot relay(kRelay, 1, large(), fast(), {.key = kRelay});
  publish_all(origin, network, difference.records, [&](const std::vector<std::byte>& said) {
    relay.exchange().receive(said, 0);
    if (!is_chunk(said)) tell(network, said, difference);
  });
  relay.exchange().receive(
      Forger::request_for_all(kAsker, std::uint64_t{1} << 40U, 1, {kOrigin, 1, 0}), 0);
  for (const auto& datagram : said(relay, 0, 4 * kSecond)) tell(network, datagram, difference);
}

constexpr double kStep_s = 0.02;

struct Outcome {
  bool equal = false;
  double seconds = 0.0;
  std::uint64_t overhead_bytes = 0;
  std::uint64_t records = 0;  ///< That were sent.
  std::uint64_t requests = 0;
  int exchanges = 0;  ///< Of a request, or of several at a time, and an answer.
};

/// Runs until both hold the same. Announcements go on as they do at rest.
Outcome reconcile(Network& network, double most_s) {
  const auto report = [&](int i) { return network.robot(i).exchange().report(); };
  Outcome outcome;
  const std::int64_t begin_us = network.now_us();
  const std::array<ExchangeReport, 2> before{report(0), report(1)};
  while (!outcome.equal && static_cast<double>(network.now_us() - begin_us) < most_s * kSecond) {
    const std::uint64_t asked = report(0).requests + report(1).requests;
    network.run(static_cast<std::int64_t>(kStep_s * kSecond));
    outcome.exchanges += report(0).requests + report(1).requests == asked ? 0 : 1;
    outcome.equal = network.agree();
  }
  outcome.seconds = 1e-6 * static_cast<double>(network.now_us() - begin_us);
  for (const int i : {0, 1}) {
    const ExchangeReport now = report(i);
    const ExchangeReport& then = before[static_cast<std::size_t>(i)];
    outcome.overhead_bytes += now.sent_bytes - then.sent_bytes;
    outcome.records += now.records_taken - then.records_taken;
    outcome.requests += now.requests - then.requests;
  }
  return outcome;
}

/// Draws what differs, lets both robots hear of it, and checks what it takes until they are equal.
void check(bool is_signed, std::uint32_t k, bool in_one_run, Kind kind) {
  const std::uint32_t records = is_signed ? kSignedRecords : kRecords;
  Network network(2, {.delay_us = 2'000, .jitter_us = 0}, oracle::announce_seed(700), large(),
                  is_signed ? ExchangeConfig{} : fast(), is_signed);
  network.run(2 * kSecond);
  Difference difference = drawn(network.random(), records, k, in_one_run, kind);
  (is_signed ? teach_signed : teach)(network, difference);
  for (const int i : {0, 1}) {
    const Replicas& replicas = network.robot(i).replicas();
    REQUIRE(replicas.contribution(*replicas.find({kOrigin, 1, 0})).blocks >= records - k);
  }
  REQUIRE_FALSE(network.agree());
  // What robots say of themselves and of other contributions at rest.
  const Outcome outcome = reconcile(network, 30.0);
  CAPTURE(k, in_one_run, static_cast<int>(kind));
  REQUIRE(outcome.equal);
  constexpr std::uint64_t kRecordBytes = 40;  // as they are made here, with what is around them
  // At 100 MB/s records take no time: what is left are exchanges of request and answer.
  const auto record_bytes = static_cast<double>(k * kRecordBytes + difference.proof_bytes);
  const double record_s = is_signed ? record_bytes / ExchangeConfig{}.bytes_per_s : 0.0;
  CHECK(outcome.seconds < 2.0 + record_s);
  // While records come, others are asked for. Of tens of thousands that takes a second also where
  // they take no time.
  if (k <= 1000) CHECK(outcome.exchanges <= 8 + record_s / kStep_s);
  CHECK(outcome.records <= k);
  CHECK(outcome.overhead_bytes <= k * (256 + kRecordBytes) + 32'000 + difference.proof_bytes);
  WARN(k << (in_one_run ? " in one run" : " scattered") << ", kind " << static_cast<int>(kind)
         << (is_signed ? ", signed: " : ": ") << outcome.seconds << " s, " << outcome.overhead_bytes
         << " bytes (proofs " << difference.proof_bytes << "), " << outcome.records << " records, "
         << outcome.requests << " requests in " << outcome.exchanges << " exchanges");
}

TEST_CASE("reconcile: what differs is what is sent") {
  const std::uint32_t k = GENERATE(1U, 10U, 1000U, kRecords / 2);
  const bool in_one_run = GENERATE(false, true);
  const Kind kind = GENERATE(Kind::kMissing, Kind::kOther);
  check(false, k, in_one_run, kind);
}

TEST_CASE("reconcile: with signatures what differs is what is sent and its proofs") {
  const std::uint32_t k = GENERATE(10U, 1U, 1000U, kSignedRecords / 2);
  const bool in_one_run = GENERATE(false, true);
  if (kIsSlow && (k != 10 || in_one_run)) return;
  check(true, k, in_one_run, Kind::kMissing);
}

}  // namespace
}  // namespace tessera::network
