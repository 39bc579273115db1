// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "link/mission.hpp"

#include <sodium.h>

#include <algorithm>
#include <string>

#include "tessera/base/assert.hpp"

namespace tessera {
namespace {

constexpr std::string_view kValueContext = "tessera 2 mission";
static_assert(Mission::kValueBytes >= crypto_generichash_BYTES_MIN);

const char* objection_to(std::string_view name) {
  if (name.empty()) return "is empty";
  if (name.size() > Mission::kMostNameBytes) return "is over 64 bytes";
  const auto is_control = [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return byte < 0x20 || byte == 0x7f;
  };
  if (std::any_of(name.begin(), name.end(), is_control)) return "has a control character";
  if (name.front() == ' ' || name.back() == ' ') return "begins or ends with a space";
  return nullptr;
}

}  // namespace

std::size_t write_mission_input(std::string_view context, const Mission& mission,
                                std::array<unsigned char, kMostMissionInputBytes>& into) noexcept {
  const std::string_view name = mission.name();
  TESSERA_ASSERT(context.size() + 1 + name.size() <= into.size());
  auto end = std::copy(context.begin(), context.end(), into.begin());
  *end++ = static_cast<unsigned char>(name.size());
  end = std::copy(name.begin(), name.end(), end);
  return static_cast<std::size_t>(end - into.begin());
}

Outcome<Mission> Mission::make(std::string_view name) {
  if (const char* const objection = objection_to(name); objection != nullptr) {
    return Failure{std::string("the mission's name ") + objection +
                   "; give 1 to 64 bytes of text, such as \"harbour 7\""};
  }
  if (::sodium_init() < 0) return Failure{"libsodium does not start", FailureKind::kFailure};
  Mission mission;
  std::copy(name.begin(), name.end(), mission.name_.begin());
  mission.name_bytes_ = name.size();
  std::array<unsigned char, kMostMissionInputBytes> input;
  const std::size_t bytes = write_mission_input(kValueContext, mission, input);
  // Fails only for lengths out of its range, and this one is a constant.
  ::crypto_generichash(reinterpret_cast<unsigned char*>(mission.value_.data()), kValueBytes,
                       input.data(), bytes, nullptr, 0);
  return mission;
}

Outcome<Mission> Mission::make_random() {
  if (::sodium_init() < 0) return Failure{"libsodium does not start", FailureKind::kFailure};
  // 40 bits: of a thousand missions two have the same name once in two million fleets.
  std::array<unsigned char, 5> random{};
  ::randombytes_buf(random.data(), random.size());
  std::array<char, 2 * random.size() + 1> digits{};
  ::sodium_bin2hex(digits.data(), digits.size(), random.data(), random.size());
  return make(std::string("mission-") + digits.data());
}

std::uint32_t Mission::number() const noexcept {
  std::uint32_t number = 0;
  for (std::size_t i = 0; i < sizeof number; ++i)
    number |= std::to_integer<std::uint32_t>(value_[i]) << (8 * i);
  return number;
}

}  // namespace tessera
