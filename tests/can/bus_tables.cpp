// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// bus_tables: writes to standard output, as JSON, the tables of messages, and frames with values as
// the code packs them: write_dbc.py writes docs/reference/can/tessera.dbc from the tables.
#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>

#include "support/random.hpp"
#include "vehicle/bus_load.hpp"
#include "vehicle/bus_table.hpp"
#include "vehicle/bus_values.hpp"

namespace tessera {
namespace {

using nlohmann::json;

std::string two_digits(int number) {
  return {static_cast<char>('0' + number / 10), static_cast<char>('0' + number % 10)};
}

std::string name_of(const BusMessage& message) {
  std::string name = message.name;
  if (message.first_sector >= 0) name.append("_").append(two_digits(message.first_sector));
  return name;
}

std::string name_of(const Signal& signal) {
  std::string name;
  if (signal.sector >= 0) name.append("Sector").append(two_digits(signal.sector));
  return name.append(signal.name);
}

std::string hex(std::span<const std::uint8_t> bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) {
    const char* const digits = "0123456789abcdef";
    text += {digits[byte >> 4U], digits[byte & 0xfU]};
  }
  return text;
}

json signal_table(const Signal& signal) {
  return {{"name", name_of(signal)},    {"start", signal.start}, {"length", signal.length},
          {"signed", signal.is_signed}, {"scale", signal.scale}, {"offset", signal.offset},
          {"least", signal.least},      {"most", signal.most},   {"unit", signal.unit}};
}

/// Values of all signals, drawn one after the other into bytes that were anything.
json example(const BusMessage& message, std::uint32_t id, std::uint8_t counter,
             oracle::Random& random) {
  std::array<std::uint8_t, kMostCanFdBytes> data{};
  for (std::uint8_t& byte : data) byte = static_cast<std::uint8_t>(random.below(256));
  json values;
  const std::span<std::uint8_t> bytes(data.data(), message.size);
  for (const Signal& signal : message.signals) {
    const double value = random.uniform(signal.least, signal.most);
    put_value(bytes, signal, value);
  }
  e2e_protect(message.e2e, e2e_data_id(id), counter, bytes);
  for (const Signal& signal : message.signals)
    values[name_of(signal)] = {{"raw", raw_of(bytes, signal)}, {"value", value_of(bytes, signal)}};
  return {{"bytes", hex(bytes)}, {"counter", counter}, {"values", values}};
}

json message_table(const BusMessage& message, oracle::Random& random) {
  const std::uint32_t id = kDefaultBaseId + message.place;
  json signals = json::array();
  for (const Signal& signal : message.signals) signals.push_back(signal_table(signal));
  json examples = json::array();
  for (std::uint8_t i = 0; i < 40; ++i)
    examples.push_back(example(message, id, static_cast<std::uint8_t>(i % 15), random));
  const FdBits fd = worst_fd_bits(message.size);
  return {{"name", name_of(message)},
          {"id", id},
          {"size", message.size},
          {"fd", message.is_fd},
          {"from_vehicle", message.from_vehicle},
          {"cycle_ms", message.cycle_ms},
          {"e2e", static_cast<int>(message.e2e)},
          {"e2e_data_id", e2e_data_id(id)},
          {"use", static_cast<int>(message.use)},
          {"classic_bits", message.is_fd ? 0 : worst_classic_bits(message.size)},
          {"fd_nominal_bits", fd.nominal},
          {"fd_data_bits", fd.data},
          {"signals", signals},
          {"examples", examples}};
}

}  // namespace
}  // namespace tessera

int main() {
  using namespace tessera;
  oracle::Random random(7501);
  json all;
  for (const BusMessage& message : kBusMessages)
    all["messages"].push_back(message_table(message, random));
  all["names"] = {{"MotionState", kMotionStates},   {"Command", kVehicleCommands},
                  {"MappingState", kMappingStates}, {"PauseReason", kPauseReasons},
                  {"PoseVerdict", kPoseVerdicts},   {"PoseSource", kPoseSources},
                  {"BusState", kBusStates},         {"CommandResult", kCommandResults},
                  {"Convergence", kConvergences},   {"SectorsState", kSectorsStates}};
  all["codes"] = {{"Distance", {bus::kNothingFound, bus::kNotAvailable}},
                  {"PoseAge", bus::kNoPoseAge},
                  {"SectorsAge", bus::kOlderThanCanBeSaid}};
  std::puts(all.dump().c_str());
  return 0;
}
