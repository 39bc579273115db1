// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "vehicle/e2e.hpp"

#include <array>

namespace tessera {
namespace {

constexpr std::uint8_t kMostCounter1 = 14;

std::uint8_t checksum1(std::uint16_t data_id, std::span<const std::uint8_t> data) noexcept {
  const std::array<std::uint8_t, 2> id{static_cast<std::uint8_t>(data_id & 0xffU),
                                       static_cast<std::uint8_t>(data_id >> 8U)};
  return crc8(data.subspan(1), crc8(id, 0));
}

std::uint16_t checksum5(std::uint16_t data_id, std::span<const std::uint8_t> data) noexcept {
  const std::array<std::uint8_t, 2> id{static_cast<std::uint8_t>(data_id & 0xffU),
                                       static_cast<std::uint8_t>(data_id >> 8U)};
  return crc16(id, crc16(data.subspan(2), 0xffff));
}

}  // namespace

std::uint8_t crc8(std::span<const std::uint8_t> bytes, std::uint8_t start) noexcept {
  unsigned crc = start;
  for (const std::uint8_t byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc << 1U) ^ ((crc & 0x80U) != 0 ? 0x11dU : 0U);
  }
  return static_cast<std::uint8_t>(crc);
}

std::uint16_t crc16(std::span<const std::uint8_t> bytes, std::uint16_t start) noexcept {
  unsigned crc = start;
  for (const std::uint8_t byte : bytes) {
    crc ^= unsigned{byte} << 8U;
    for (int bit = 0; bit < 8; ++bit) crc = (crc << 1U) ^ ((crc & 0x8000U) != 0 ? 0x11021U : 0U);
  }
  return static_cast<std::uint16_t>(crc);
}

const char* to_string(E2eStatus status) noexcept {
  switch (status) {
    case E2eStatus::kOk:
      return "ok";
    case E2eStatus::kOkSomeLost:
      return "some lost";
    case E2eStatus::kInitial:
      return "initial";
    case E2eStatus::kSync:
      return "sync";
    case E2eStatus::kRepeated:
      return "repeated";
    case E2eStatus::kWrongSequence:
      return "wrong sequence";
    case E2eStatus::kWrongCrc:
      return "wrong crc";
  }
  return "invalid";
}

void e2e_protect(E2eProfile profile, std::uint16_t data_id, std::uint8_t counter,
                 std::span<std::uint8_t> data) noexcept {
  if (data.size() < e2e_header_bytes(profile)) return;
  if (profile == E2eProfile::kProfile1) {
    data[1] = static_cast<std::uint8_t>((data[1] & 0xf0U) | (counter & 0x0fU));
    data[0] = checksum1(data_id, data);
  } else if (profile == E2eProfile::kProfile5) {
    data[2] = counter;
    const std::uint16_t crc = checksum5(data_id, data);
    data[0] = static_cast<std::uint8_t>(crc & 0xffU);
    data[1] = static_cast<std::uint8_t>(crc >> 8U);
  }
}

E2eStatus E2eChecker::check(std::span<const std::uint8_t> data) noexcept {
  if (data.size() != config_.size || data.size() < e2e_header_bytes(config_.profile))
    return E2eStatus::kWrongCrc;
  std::uint8_t counter = 0;
  int modulus = 256;
  switch (config_.profile) {
    case E2eProfile::kNone:
      return E2eStatus::kOk;
    case E2eProfile::kProfile1:
      counter = data[1] & 0x0fU;
      modulus = kMostCounter1 + 1;
      if (counter > kMostCounter1 || data[0] != checksum1(config_.data_id, data))
        return E2eStatus::kWrongCrc;
      break;
    case E2eProfile::kProfile5:
      counter = data[2];
      if ((data[0] | unsigned{data[1]} << 8U) != checksum5(config_.data_id, data))
        return E2eStatus::kWrongCrc;
      break;
  }
  const int delta = (counter - last_ + modulus) % modulus;
  last_ = counter;
  if (!known_) {
    known_ = true;
    return E2eStatus::kInitial;
  }
  if (delta == 0) return E2eStatus::kRepeated;
  if (delta > config_.max_delta) {
    unsure_ = config_.sync;
    return E2eStatus::kWrongSequence;
  }
  if (unsure_ > 0) {
    --unsure_;
    return E2eStatus::kSync;
  }
  return delta == 1 ? E2eStatus::kOk : E2eStatus::kOkSomeLost;
}

}  // namespace tessera
