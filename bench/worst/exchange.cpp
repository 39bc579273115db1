// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The exchange on what costs it most: blocks in which every voxel has what a code can say, chunks
// of as many records as fit, requests of as many gaps, and a contribution of many parts to look
// through.
#include <memory>

#include "meter.hpp"
#include "published.hpp"
#include "tessera/exchange/internal/block_codec.hpp"
#include "tessera/exchange/internal/frames.hpp"

namespace tessera::bench {

namespace {

constexpr int kComponents = kMostClasses + 2;
constexpr double kRow = 512.0 * kComponents;  // of a look through a block
constexpr std::uint32_t kParts = 4096;
constexpr std::uint32_t kOthers = 16;
constexpr double kAnswers = 64.0;  // ExchangeConfig::answers

/// Every voxel has three components, a rest and passes, each voxel others than the one before.
void fill_worst(BlockContent& content, unsigned seed) {
  content.clear();
  for (int row = 0; row < kBlockVoxels; ++row) {
    const unsigned mixed = static_cast<unsigned>(mix64(seed * 512U + static_cast<unsigned>(row)));
    for (unsigned k = 0; k < 4; ++k) {
      const int component = 1 + static_cast<int>((mixed + k * 17) % (kComponents - 1));
      content.add(component, row, 0.5F + static_cast<float>((mixed >> (4 * k)) % 64));
    }
    content.add_passes(row, 1U + mixed % 200);
  }
  quantise(content);
}

struct Own {
  Own() : memory(BlockContent::required_bytes(kComponents)) {
    Arena arena = memory.arena();
    content = *BlockContent::make(arena, kComponents);
  }
  Memory memory;
  BlockContent content;
};

struct Robot {
  explicit Robot(std::uint32_t number) : memory(bytes()) {
    Arena arena = memory.arena();
    ExchangeConfig own = config();
    own.robot = number;
    replicas = *Replicas::make(arena, replicas_config());
    exchange = *Exchange::make(arena, own, store_of(replicas), crc_authenticator(),
                               table_of(kMostClasses));
    if (exchange.open(1, 0, Matrix34d::Identity()) != Status::kOk) std::abort();
  }
  static ReplicasConfig replicas_config() {
    return {.segments = 1U << 16U,
            .blocks = 2 * kParts,
            .contributions = 32,
            .robot_segments = 1U << 16U};
  }
  static ExchangeConfig config() {
    ExchangeConfig config;
    config.contributions = 32;
    config.records = 2 * kParts;
    config.bytes_per_s = 1'000'000'000;
    config.burst_bytes = 1U << 30U;
    config.fresh = 1;  // so that what is sent has to be searched for
    return config;
  }
  static std::size_t bytes() {
    return Replicas::required_bytes(replicas_config()) +
           Exchange::required_bytes(config(), kComponents);
  }
  std::size_t send() { return exchange.send(now_us, datagram); }
  std::span<const std::byte> said(std::size_t size) const {
    return std::span<const std::byte>(datagram).first(size);
  }
  Memory memory;
  Replicas replicas;
  Exchange exchange;
  std::int64_t now_us = 0;
  std::array<std::byte, kMostDatagramBytes> datagram{};
};

void measure_codec(Meter& meter) {
  Own own;
  Own read;
  fill_worst(own.content, 1);
  std::vector<std::byte> code(most_coded_bytes(kBlockLayers));
  std::size_t size = 0;
  meter.measure(
      {"encode_wire_block", "encode_block", "all that a code can say, in every voxel",
       "512 (C + 2)"},
      1, [] {},
      [&] {
        size = encode_block(own.content, kAllLayers, code);
        return fixed(size != 0, kRow);
      });
  meter.measure(
      {"decode_wire_block", "decode_block", "the same", "512 (C + 2)"}, 1,
      [&] { read.content.clear(); },
      [&] {
        const auto bytes = std::span<const std::byte>(code).first(size);
        return fixed(decode_block(bytes, kAllLayers, kComponents, read.content) == Status::kOk,
                     kRow);
      });
  meter.measure(
      {"quantise", "quantise", "every voxel with every class", "512 (C + 2)"}, 1,
      [&] {
        own.content.clear();
        for (int row = 0; row < kBlockVoxels; ++row) {
          for (int l = 1; l <= kMostClasses + 1; ++l)
            own.content.add(l, row, 0.25F * static_cast<float>(1 + (row * 7 + l * 3) % 50));
        }
      },
      [&] {
        quantise(own.content);
        return fixed(own.content.label_octets() != 0, kRow);
      });
}

void measure_publishing(Meter& meter) {
  auto robot = std::make_unique<Robot>(1);
  Own own;
  fill_worst(own.content, 2);
  meter.measure(
      {"publish", "Exchange::publish", "the same, which takes four parts", "12 * 512 (C + 2)"}, 1,
      [] {},
      [&] {
        const bool done = robot->exchange.publish(pack_in_grid({1, 2, 3}), own.content).ok();
        return fixed(done && robot->exchange.report().published_parts % 4 == 0, 12.0 * kRow);
      });
  // One voxel each: as many parts for as few bytes.
  for (std::int32_t i = 0; i < static_cast<std::int32_t>(kParts); ++i) {
    own.content.clear();
    own.content.add(1 + i % kMostClasses, i % kBlockVoxels, 1.0F);
    quantise(own.content);
    if (!robot->exchange.publish(pack_in_grid({i % 64, i / 64, 0}), own.content).ok()) std::abort();
  }
  // What comes before chunks: the frame, an announcement, and the frame that is said with it.
  for (int i = 0; i < 3; ++i) static_cast<void>(robot->send());
  meter.measure(
      {"send_parts", "Exchange::send", "one of 4,096 parts of one voxel, all searched",
       "parts log 128 + 1,392 bytes"},
      1, [] {},
      [&] {
        const std::size_t size = robot->send();
        const bool is_chunk = robot->datagram[3] == std::byte{3};
        return fixed(is_chunk, 7.0 * kParts + static_cast<double>(size));
      });
}

/// A chunk of records that are all news to who has heard nothing but the frame.
void measure_receiving(Meter& meter) {
  auto origin = std::make_unique<Robot>(1);
  Own own;
  for (std::int32_t i = 0; i < 400; ++i) {
    own.content.clear();
    own.content.add(1, i % kBlockVoxels, 1.0F);
    quantise(own.content);
    if (!origin->exchange.publish(pack_in_grid({i, 0, 0}), own.content).ok()) std::abort();
  }
  std::vector<std::vector<std::byte>> before;
  std::vector<std::byte> chunk;
  while (chunk.empty()) {
    const auto said = origin->said(origin->send());
    std::vector<std::byte> copy(said.begin(), said.end());
    const bool is_chunk = copy.at(3) == std::byte{3};
    (is_chunk ? chunk : before.emplace_back()) = std::move(copy);
  }
  std::unique_ptr<Robot> other;
  std::uint64_t records = 0;
  const auto renew = [&] {
    other = std::make_unique<Robot>(2);
    for (const auto& datagram : before) other->exchange.receive(datagram, 0);
  };
  renew();
  other->exchange.receive(chunk, 0);
  records = other->exchange.report().records_taken;
  meter.measure({"receive_chunk", "Exchange::receive",
                 "as many records of one voxel as fit, all news", "records * 512 (C + 2)"},
                1, renew, [&] {
                  other->exchange.receive(chunk, 0);
                  const bool all = other->exchange.report().records_taken == records;
                  return fixed(all && records > 100, static_cast<double>(records) * kRow);
                });
}

/// A request for all versions of all contributions, of which this robot has every other one: each
/// would be an answer of its own.
void measure_request(Meter& meter) {
  auto robot = std::make_unique<Robot>(99);
  std::vector<std::byte> datagram(kMostDatagramBytes);
  std::uint32_t sequence = 0;
  const auto say = [&](DatagramKind kind, auto&& write) {
    ByteWriter to(datagram);
    const ExchangeConfig config;
    const ConfigurationDetails details{.resolution_m = config.resolution_m,
                                       .prior = config.prior,
                                       .free_weight = config.free_weight,
                                       .classes = kMostClasses,
                                       .class_table = class_table_checksum(table_of(kMostClasses)),
                                       .max_evidence = config.max_evidence};
    write_header(to, {.kind = kind,
                      .configuration = details.checksum(),
                      .sender = 50,
                      .session = 1,
                      .sequence = ++sequence});
    write(to);
    const std::size_t size = to.size();
    const Authenticator crc = crc_authenticator();
    const std::span<std::byte> all(datagram);
    const std::span<std::byte, kTagBytes> tag{all.subspan(size, kTagBytes)};
    crc.tag(nullptr, all.first(size), tag);
    return std::span<const std::byte>(all.first(size + kTagBytes));
  };
  for (std::uint32_t other = 1; other <= kOthers; ++other) {
    const ContributionId id{other, 1, 0};
    robot->exchange.receive(say(DatagramKind::kFrame,
                                [&](ByteWriter& to) {
                                  write_frames_header(to, {.robot = other, .relayed = true});
                                  if (!FrameWriter(to).write({.id = id, .revision = 1}))
                                    std::abort();
                                }),
                            0);
    for (std::uint32_t v = 1; v <= 2 * Coverage::kMostRanges; v += 2) {
      robot->exchange.receive(
          say(DatagramKind::kChunk,
              [&](ByteWriter& to) {
                write_chunk_header(to, {.id = id, .range = {v, v}, .relayed = true});
              }),
          0);
    }
  }
  std::span<const std::byte> request;
  meter.measure(
      {"receive_request", "Exchange::receive",
       "all of 16 contributions with 256 ranges of coverage each; 64 answers wait",
       "(answers + contributions) answers"},
      1,
      [&] {
        request = say(DatagramKind::kRequest, [&](ByteWriter& to) {
          for (std::uint32_t other = 1; other <= kOthers; ++other) {
            RequestedContribution wanted;
            wanted.id = {other, 1, 0};
            wanted.frame_revision = 1;
            wanted.count = 1;
            wanted.gap[0] = {1, 4'000'000'000U};
            if (!write_requested(to, wanted)) break;
          }
        });
      },
      [&] {
        robot->exchange.receive(request, 0);
        const bool heard = robot->exchange.report().waiting_answers != 0;
        return fixed(heard, (kAnswers + kOthers) * kAnswers);
      });
}

}  // namespace

void measure_exchange(Meter& meter) {
  measure_codec(meter);
  measure_publishing(meter);
  measure_receiving(meter);
  measure_request(meter);
}

}  // namespace tessera::bench
