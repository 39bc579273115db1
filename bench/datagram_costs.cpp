// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What does a datagram cost: its tag and signature, its way through a link, and what would it cost
// as a typed LCM message instead of raw payload? datagram_costs [INTERFACE]: the interface to send
// by, lo by default; ttl 0, so nothing leaves the machine. Times are of one call, the clock's
// share included.
#include <time.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <random>
#include <sized_payload_1376.hpp>
#include <sized_payload_256.hpp>
#include <sized_payload_640.hpp>
#include <vector>

#include "harness.hpp"
#include "link/datagram_link.hpp"
#include "link/datagram_seal.hpp"
#include "link/record_signature.hpp"

namespace tessera::bench {

namespace {

using Bytes = std::vector<std::byte>;

constexpr int kCalls = 2000;
constexpr unsigned kSeed = 1;

double now_us() {
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<double>(now.tv_sec) * 1e6 + static_cast<double>(now.tv_nsec) * 1e-3;
}

void print_times(const char* what, std::vector<double> us) {
  std::sort(us.begin(), us.end());
  std::printf("%-34s %8.2f %8.2f %8.2f\n", what, quantile(us, 0.5), quantile(us, 0.99), us.back());
}

template <class Work>
void time_calls(const char* what, Work work) {
  std::vector<double> us;
  for (int i = 0; i < kCalls; ++i) {
    const double start_us = now_us();
    work(i);
    us.push_back(now_us() - start_us);
  }
  print_times(what, std::move(us));
}

/// Full datagrams, each another, so that nothing is learned from the last.
std::vector<Bytes> datagrams(std::size_t bytes) {
  std::mt19937 random(kSeed);
  std::vector<Bytes> all(64, Bytes(bytes));
  for (Bytes& one : all)
    for (std::byte& b : one) b = static_cast<std::byte>(random());
  return all;
}

int measure_security() {
  RobotSecret secret;
  const Outcome<Mission> mission = Mission::make("costs");
  if (!mission.ok()) return 2;
  const Outcome<DatagramSeal> seal = DatagramSeal::make(secret.seed, *mission, KeyUse::kDatagram);
  const Outcome<RecordSigner> signer = RecordSigner::make(secret, *mission);
  // The public half of that all-zero seed.
  const char* const open_hex = "3b6a27bcceb6a42d62a3a8d02a6f0d73653215771de243a63ac048a18b59da29";
  RobotPublic open;
  for (std::size_t i = 0; i < kKeyBytes; ++i) {
    unsigned value = 0;
    static_cast<void>(std::sscanf(open_hex + 2 * i, "%2x", &value));
    open.key[i] = static_cast<unsigned char>(value);
  }
  const Outcome<RecordVerifier> verifier = RecordVerifier::make({open}, *mission);
  if (!seal.ok() || !signer.ok() || !verifier.ok()) return 2;
  const std::vector<Bytes> all = datagrams(1392);
  const auto one = [&all](int i) { return std::span(all[static_cast<std::size_t>(i) % 64]); };
  std::array<std::byte, kTagBytes> tag{};
  std::array<std::byte, kSignatureBytes> signature{};
  bool good = true;
  const Authenticator crc = crc_authenticator();
  time_calls("CRC-32C of 1392 bytes", [&](int i) { crc.tag(nullptr, one(i), tag); });
  time_calls("tag of 1392 bytes", [&](int i) { seal->tag(one(i), tag); });
  seal->tag(one(0), tag);
  time_calls("check a tag", [&](int) { good = seal->check(one(0), tag) && good; });
  time_calls("sign 1392 bytes", [&](int i) { signer->sign(one(i), signature); });
  signer->sign(one(0), signature);
  time_calls("verify a signature",
             [&](int) { good = verifier->check(0, one(0), signature) && good; });
  return good ? 0 : 3;
}

/// Payload in the smallest type that holds it: bytes on the wire after the channel's zero, and
/// back.
template <class Type>
std::size_t through_type(std::span<const std::byte> payload, Bytes& wire, Bytes& back) {
  Type message;
  message.used = static_cast<std::int32_t>(payload.size());
  std::copy(payload.begin(), payload.end(), reinterpret_cast<std::byte*>(message.payload));
  const int bytes = message.encode(wire.data(), 0, static_cast<int>(wire.size()));
  Type read;
  if (bytes < 0 || read.decode(wire.data(), 0, bytes) != bytes) return 0;
  const auto* const from = reinterpret_cast<const std::byte*>(read.payload);
  std::copy_n(from, read.used, back.begin());
  return static_cast<std::size_t>(bytes);
}

std::size_t through_class(std::span<const std::byte> payload, Bytes& wire, Bytes& back) {
  if (payload.size() <= 256) return through_type<sized_payload_256>(payload, wire, back);
  if (payload.size() <= 640) return through_type<sized_payload_640>(payload, wire, back);
  return through_type<sized_payload_1376>(payload, wire, back);
}

void measure_types(const char* what, std::size_t least, std::size_t most) {
  std::mt19937 random(kSeed);
  const Bytes source = datagrams(1392).front();
  Bytes wire(2048), back(2048);
  std::vector<double> raw_us, typed_us;
  double raw_bytes = 0.0, typed_bytes = 0.0;
  for (int i = 0; i < kCalls; ++i) {
    const std::size_t bytes = least + random() % (most - least + 1);
    const auto payload = std::span(source).first(bytes);
    double start_us = now_us();
    std::copy(payload.begin(), payload.end(), wire.begin());
    std::copy_n(wire.begin(), bytes, back.begin());
    raw_us.push_back(now_us() - start_us);
    raw_bytes += static_cast<double>(bytes);
    start_us = now_us();
    typed_bytes += static_cast<double>(through_class(payload, wire, back));
    typed_us.push_back(now_us() - start_us);
  }
  std::printf("%s: raw %.0f bytes, typed %.0f (+%.1f %%)\n", what, raw_bytes / kCalls,
              typed_bytes / kCalls, 100.0 * (typed_bytes / raw_bytes - 1.0));
  print_times("  raw, in and out", std::move(raw_us));
  print_times("  typed, in and out", std::move(typed_us));
}

int measure_link(const char* interface) {
  LinkConfig config{.url = "udpm://239.255.76.68:7668?ttl=0&recv_buf_size=4194304",
                    .channel = "TESSERA_BENCH",
                    .interface = interface};
  const Outcome<std::unique_ptr<DatagramLink>> a = DatagramLink::open(config);
  const Outcome<std::unique_ptr<DatagramLink>> b = DatagramLink::open(config);
  for (const auto* const link : {&a, &b}) {
    if (link->ok()) continue;
    std::fprintf(stderr, "datagram_costs: %s\n", link->failure().text().c_str());
    return 2;
  }
  const Bytes payload = datagrams((*a)->max_payload_bytes()).front();
  std::array<std::byte, kMaxMessageBytes> buffer;
  time_calls("send 1386 bytes", [&](int) {
    (*a)->send(payload);
    while (!(*b)->receive(buffer).bytes.empty()) {
    }
  });
  const timespec settle{0, 100'000'000};
  ::nanosleep(&settle, nullptr);
  while (!(*b)->receive(buffer).bytes.empty()) {
  }
  std::vector<double> us;
  for (int i = 0; i < kCalls; ++i) {
    const double start_us = now_us();
    (*a)->send(payload);
    static_cast<void>((*b)->wait(100'000));
    static_cast<void>((*b)->receive(buffer));
    us.push_back(now_us() - start_us);
    const timespec pause{0, 100'000};
    ::nanosleep(&pause, nullptr);
  }
  const LinkReport sent = (*a)->report(), heard = (*b)->report();
  print_times("from send to receive, by wait", std::move(us));
  std::printf("sent %llu, received %llu, queue full %llu, dropped by the kernel %llu\n",
              static_cast<unsigned long long>(sent.sent),
              static_cast<unsigned long long>(heard.received),
              static_cast<unsigned long long>(heard.queue_full),
              static_cast<unsigned long long>(heard.kernel_dropped));
  return 0;
}

}  // namespace

}  // namespace tessera::bench

int main(int argc, char** argv) {
  using namespace tessera::bench;
  std::printf("%-34s %8s %8s %8s  us\n", "", "median", "p99", "max");
  const int secured = measure_security();
  if (secured != 0) return secured;
  measure_types("payloads of 1 to 1376 bytes", 1, 1376);
  measure_types("payloads of 1200 to 1376 bytes", 1200, 1376);
  return measure_link(argc > 1 ? argv[1] : "lo");
}
