// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The formula for the worst case against frames that are put together and stuffed bit by bit.
#include "vehicle/bus_load.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <vector>

#include "support/random.hpp"
#include "vehicle/bus_table.hpp"

namespace tessera {
namespace {

using Bits = std::vector<bool>;

void append(Bits& bits, std::uint32_t value, unsigned width) {
  for (unsigned i = width; i-- > 0;) bits.push_back(((value >> i) & 1U) != 0);
}

/// CRC-15 of CAN.
std::uint32_t crc15(const Bits& bits) {
  std::uint32_t crc = 0;
  for (const bool bit : bits) {
    const bool flip = bit != (((crc >> 14U) & 1U) != 0);
    crc = (crc << 1U) & 0x7fffU;
    if (flip) crc ^= 0x4599U;
  }
  return crc;
}

/// Bits that a sender adds: one behind every five equal ones, which counts among the next five.
std::uint32_t stuffed(const Bits& bits) {
  std::uint32_t added = 0;
  int run = 0;
  bool last = false;
  for (std::size_t i = 0; i < bits.size(); ++i) {
    run = i > 0 && bits[i] == last ? run + 1 : 1;
    last = bits[i];
    if (run == 5) {
      ++added;
      last = !last;
      run = 1;
    }
  }
  return added;
}

std::uint32_t bits_of_frame(std::uint32_t id, const std::vector<std::uint8_t>& data) {
  Bits bits{false};  // SOF
  append(bits, id, 11);
  append(bits, 0, 3);  // RTR, IDE, r0
  append(bits, static_cast<std::uint32_t>(data.size()), 4);
  for (const std::uint8_t byte : data) append(bits, byte, 8);
  append(bits, crc15(bits), 15);
  return static_cast<std::uint32_t>(bits.size()) + stuffed(bits) + kUnstuffedBits;
}

TEST_CASE("worst_classic_bits: no frame takes longer, and the bound is that of the literature") {
  CHECK(worst_classic_bits(8) == 135);
  CHECK(worst_classic_bits(0) == 55);
  oracle::Random random(7201);
  for (std::size_t size = 0; size <= 8; ++size) {
    const std::uint32_t bound = worst_classic_bits(static_cast<std::uint32_t>(size));
    std::uint32_t most = 0;
    for (int round = 0; round < 3000; ++round) {
      std::vector<std::uint8_t> data(size);
      const int kind = random.below(3);
      for (std::uint8_t& byte : data) {
        const int any = random.below(256);
        byte = static_cast<std::uint8_t>(kind == 0 ? any : kind == 1 ? 0 : 0xff);
      }
      const int id = random.below(0x800);
      const std::uint32_t bits = bits_of_frame(static_cast<std::uint32_t>(id), data);
      most = std::max(most, bits);
      REQUIRE(bits <= bound);
    }
    // Frames that are all zeros come near it.
    CHECK(most > bound - bound / 10);
  }
}

TEST_CASE("worst_classic_bits: bits that are stuffed as badly as can be reach the bound") {
  for (std::uint32_t size = 0; size <= 8; ++size) {
    // Five equal, then four, four, ... of the other kind each: every stuffed bit begins a new five.
    const std::size_t count = kClassicStuffedBits + 8 * size;
    Bits bits;
    bool kind = false;
    while (bits.size() < count) {
      const std::size_t run = bits.empty() ? 5 : 4;
      for (std::size_t i = 0; i < run && bits.size() < count; ++i) bits.push_back(kind);
      kind = !kind;
    }
    CHECK(stuffed(bits) + bits.size() + kUnstuffedBits == worst_classic_bits(size));
  }
}

TEST_CASE("worst_fd_bits: the parts by hand") {
  // 8 bytes: 17 + 69 bits are stuffed at most 21 times, 4 of these in the first 17; CRC-17 with its
  // stuff count is 21 bits and 6 fixed ones.
  CHECK(worst_fd_bits(8).nominal == 17 + 4 + 13);
  CHECK(worst_fd_bits(8).data == 69 + 17 + 21 + 6);
  // 64 bytes: CRC-21 with its stuff count is 25 bits and 7 fixed ones.
  CHECK(worst_fd_bits(64).nominal == 17 + 4 + 13);
  CHECK(worst_fd_bits(64).data == 517 + (533 / 4 - 4) + 25 + 7);
  CHECK(worst_fd_bits(16).data - worst_fd_bits(12).data == 32 + 8);
  CHECK(worst_fd_nominal_bits(64, 4.0) == 34 + 678 / 4.0);
}

/// Of all messages that are on the bus together, percent of the slower bit rate.
double load_percent(bool fd_pose, bool fd_sectors, int sectors, double rate, double fd_ratio) {
  double bits = 0.0;
  for (const BusMessage& message : kBusMessages) {
    if (message.use == BusUse::kClassicPose && fd_pose) continue;
    if (message.use == BusUse::kFdPose && !fd_pose) continue;
    if (message.use == BusUse::kClassicSectors && fd_sectors) continue;
    if (message.use == BusUse::kFdSectors && !fd_sectors) continue;
    if (message.first_sector >= sectors) continue;
    const double each = message.is_fd ? worst_fd_nominal_bits(message.size, fd_ratio)
                                      : worst_classic_bits(message.size);
    bits += each * 1000.0 / message.cycle_ms;
  }
  return 100.0 * bits / rate;
}

TEST_CASE("bus load: under 30 % of 500 kbit/s, whatever is configured") {
  // The same numbers as in docs/reference/can.md, where another test looks them up.
  CHECK(load_percent(false, false, 16, 500e3, 4) == Approx(11.04).margin(0.005));
  CHECK(load_percent(false, false, 32, 500e3, 4) == Approx(15.36).margin(0.005));
  CHECK(load_percent(true, true, 16, 500e3, 4) == Approx(5.12).margin(0.005));
  for (const bool fd : {false, true})
    for (const int sectors : {16, 32}) CHECK(load_percent(fd, fd, sectors, 500e3, 4) < 30.0);
  // Even 32 sectors leave half of a bus of 250 kbit/s.
  CHECK(load_percent(false, false, 32, 250e3, 4) < 50.0);
}

}  // namespace
}  // namespace tessera
