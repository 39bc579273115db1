// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a robot publishes, as it goes out: an exchange with replicas of its own, whose datagrams are
// counted, and heard by another one.
#pragma once

#include <memory>
#include <unordered_map>
#include <vector>

#include "tessera/exchange/exchange.hpp"
#include "tessera/exchange/publisher.hpp"
#include "thread_time.hpp"

namespace tessera::bench {

/// Bytes aligned as an arena must be.
class Memory {
 public:
  explicit Memory(std::size_t bytes)
      : size_(align_up(bytes, kArenaAlignment)),
        bytes_(static_cast<std::byte*>(std::aligned_alloc(kArenaAlignment, size_))) {}
  Arena arena() { return Arena(std::span<std::byte>(bytes_.get(), size_)); }

 private:
  struct Free {
    void operator()(std::byte* bytes) const { std::free(bytes); }
  };
  std::size_t size_;
  std::unique_ptr<std::byte, Free> bytes_;
};

class Published {
 public:
  Published(const MapConfig& map, const ClassTable& classes, const Signatures& signatures = {})
      : memory_(2 * (Replicas::required_bytes(replicas_config()) +
                     Exchange::required_bytes(exchange_config(map), classes.num_components()))) {
    Arena arena = memory_.arena();
    replicas_ = *Replicas::make(arena, replicas_config());
    exchange_ = *Exchange::make(arena, exchange_config(map), store_of(replicas_),
                                crc_authenticator(), classes, signatures);
    heard_ = *Replicas::make(arena, replicas_config());
    ExchangeConfig hearing = exchange_config(map);
    hearing.robot = 1;
    hearing_ =
        *Exchange::make(arena, hearing, store_of(heard_), crc_authenticator(), classes, signatures);
    opened_ = exchange_.open(1, 0, Matrix34d::Identity()) == Status::kOk;
    to_exchange_ = publication_of(exchange_);
  }
  Published(const Published&) = delete;
  Published& operator=(const Published&) = delete;

  Publication interface() {
    return {.context = this,
            .quantise =
                [](void* self, BlockContent& content) {
                  auto* const published = static_cast<Published*>(self);
                  published->timed([&] { published->to_exchange_.quantise(nullptr, content); });
                },
            .read =
                [](void* self, BlockKey key, BlockContent& content) {
                  auto* const published = static_cast<Published*>(self);
                  bool found = false;
                  published->timed([&] { found = published->read(key, content); });
                  return found;
                },
            .publish =
                [](void* self, BlockKey key, const BlockContent& content) {
                  auto* const published = static_cast<Published*>(self);
                  Result<WireBytes> bytes = Status::kBusy;
                  published->timed([&] { bytes = published->publish(key, content); });
                  return bytes;
                },
            .whole = nullptr};
  }
  [[nodiscard]] bool read(BlockKey key, BlockContent& content) const {
    return exchange_.read_published(key, content);
  }
  /// Bytes of the datagrams that are due by now, with what LCM, UDP and IP put before each.
  std::size_t send(std::int64_t now_us) {
    constexpr std::size_t kBefore = 8 + 8 + 20 + 8;  // the channel, LCM, IP, UDP
    std::size_t bytes = 0;
    while (true) {
      std::size_t size = 0;
      timed([&] { size = exchange_.send(now_us, datagram_); });
      if (size == 0) return bytes;
      bytes += size + kBefore;
      const double start_ms = thread_cpu_ms();
      hearing_.receive(std::span(datagram_).first(size), now_us);
      hearing_ms_ += thread_cpu_ms() - start_ms;
    }
  }
  /// CPU time in all of this.
  [[nodiscard]] double cpu_spent_ms() const { return spent_ms_; }
  /// Of the robot that hears it.
  [[nodiscard]] double cpu_hearing_ms() const { return hearing_ms_; }
  [[nodiscard]] std::uint64_t records_heard() const { return hearing_.report().records_taken; }
  [[nodiscard]] const std::unordered_map<std::uint64_t, int>& times_sent() const { return sent_; }
  [[nodiscard]] bool ok() const { return opened_; }

 private:
  static ReplicasConfig replicas_config() {
    return {.segments = 1U << 21U,
            .blocks = 1U << 19U,
            .contributions = 2,
            .robot_segments = 1U << 21U};
  }
  static ExchangeConfig exchange_config(const MapConfig& map) {
    return {.resolution_m = map.resolution_m,
            .prior = map.prior,
            .free_weight = map.free_weight,
            .contributions = 2,
            .records = replicas_config().blocks,
            .bytes_per_s = 12'500'000};
  }
  Result<WireBytes> publish(BlockKey key, const BlockContent& content) {
    const Result<WireBytes> bytes = to_exchange_.publish(&exchange_, key, content);
    if (bytes.ok() && bytes->labels > 0) ++sent_[key.bits];
    return bytes;
  }
  template <class Work>
  void timed(Work&& work) {
    const double start_ms = thread_cpu_ms();
    work();
    spent_ms_ += thread_cpu_ms() - start_ms;
  }

  Memory memory_;
  Replicas replicas_;
  Exchange exchange_;
  Replicas heard_;
  Exchange hearing_;
  Publication to_exchange_;
  bool opened_ = false;
  std::vector<std::byte> datagram_ = std::vector<std::byte>(kMostDatagramBytes);
  double spent_ms_ = 0.0;
  double hearing_ms_ = 0.0;
  std::unordered_map<std::uint64_t, int> sent_;
};

}  // namespace tessera::bench
