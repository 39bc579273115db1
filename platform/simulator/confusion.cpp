// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The figures were measured from a published range-image network's predictions on SemanticKITTI
// sequence 08: wrong answers in tenths of a percent of all points of the class (relative weights
// here), error rates of points away from borders near the sensor, and their growth with range.
// If that sequence has too few points of a class for a measurement (person, bicycle, parking,
// fence), the rate of errors is set lower than measured: the network found almost none of them.
//
// Wrong answers for an object are of two kinds. Some are what the object as a whole resembles (a
// car a truck, a person a trunk). The others are its surroundings: the network gives them at the
// border of the object in the image, never for the whole object; for a car almost all errors are of
// this kind. Labels that bleed over borders simulate these; drawing them for whole objects too
// would turn cars into terrain.
#include "simulator/confusion.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>

namespace tessera::street {
namespace {

constexpr std::uint16_t kMotorcycle = 15;
constexpr std::uint16_t kTruck = 18;
constexpr std::uint16_t kOtherVehicle = 20;
constexpr std::uint16_t kOtherGround = 49;

constexpr std::uint16_t raw(RawId id) { return static_cast<std::uint16_t>(id); }

struct Answer {
  std::uint16_t id;
  int weight;
};

/// mistake = rate * (1 + growth * (range / 30 m)^2) * (1 + lean * (1 - cos_incidence)), away from
/// borders.
struct Row {
  RawId truth;
  double rate;
  double growth;
  double lean;
  bool thing;
  std::array<Answer, 9> answers;   ///< Of a whole thing, or of a patch of a surface.
  std::array<Answer, 4> border{};  ///< Of an object: only next to what they name.
};

constexpr std::uint16_t kCar = raw(RawId::kCar);
constexpr std::uint16_t kBicycle = raw(RawId::kBicycle);
constexpr std::uint16_t kPerson = raw(RawId::kPerson);
constexpr std::uint16_t kRoad = raw(RawId::kRoad);
constexpr std::uint16_t kParking = raw(RawId::kParking);
constexpr std::uint16_t kSidewalk = raw(RawId::kSidewalk);
constexpr std::uint16_t kBuilding = raw(RawId::kBuilding);
constexpr std::uint16_t kFence = raw(RawId::kFence);
constexpr std::uint16_t kVegetation = raw(RawId::kVegetation);
constexpr std::uint16_t kTrunk = raw(RawId::kTrunk);
constexpr std::uint16_t kTerrain = raw(RawId::kTerrain);
constexpr std::uint16_t kPole = raw(RawId::kPole);
constexpr std::uint16_t kSign = raw(RawId::kTrafficSign);

constexpr std::array<Row, 14> kRows{{
    {RawId::kCar,
     0.010,
     3.0,
     0.8,
     true,
     {{{kOtherVehicle, 6}, {kTruck, 3}}},
     {{{kPole, 13}, {kRoad, 11}, {kTerrain, 10}, {kFence, 6}}}},
    {RawId::kBicycle,
     0.50,
     0.5,
     0.3,
     true,
     {{{kPole, 534}, {kMotorcycle, 362}}},
     {{{kSidewalk, 69}, {kCar, 9}, {kFence, 9}}}},
    {RawId::kPerson,
     0.42,
     0.6,
     0.3,
     true,
     {{{kTrunk, 405},
       {kVegetation, 214},
       {kFence, 128},
       {kPole, 118},
       {kBicycle, 51},
       {kOtherVehicle, 15}}},
     {{{kCar, 35}, {kTerrain, 17}, {kBuilding, 16}}}},
    {RawId::kRoad,
     0.008,
     8.0,
     0.2,
     false,
     {{{kSidewalk, 33}, {kParking, 10}, {kTerrain, 7}, {kCar, 6}}}},
    {RawId::kParking,
     0.35,
     1.0,
     0.2,
     false,
     {{{kSidewalk, 491}, {kTerrain, 354}, {kRoad, 155}, {kCar, 51}, {kPole, 9}}}},
    {RawId::kSidewalk,
     0.045,
     3.0,
     0.2,
     false,
     {{{kTerrain, 57}, {kParking, 44}, {kPole, 8}, {kRoad, 7}, {kOtherGround, 3}, {kTrunk, 3}}}},
    {RawId::kBuilding,
     0.14,
     0.6,
     0.6,
     false,
     {{{kVegetation, 106},
       {kFence, 103},
       {kTrunk, 87},
       {kPole, 16},
       {kCar, 11},
       {kSidewalk, 9},
       {kBicycle, 8},
       {kTerrain, 3}}}},
    {RawId::kFence,
     0.38,
     0.3,
     0.4,
     false,
     {{{kTerrain, 256},
       {kTrunk, 160},
       {kPole, 137},
       {kVegetation, 70},
       {kCar, 67},
       {kOtherGround, 30},
       {kSign, 21},
       {kSidewalk, 9}}}},
    {RawId::kVegetation,
     0.10,
     0.6,
     0.3,
     false,
     {{{kTrunk, 86},
       {kTerrain, 71},
       {kPole, 19},
       {kSign, 12},
       {kBuilding, 8},
       {kFence, 5},
       {kOtherGround, 5}}}},
    {RawId::kTrunk,
     0.04,
     2.0,
     0.4,
     true,
     {{{kVegetation, 73}, {kPole, 22}, {kSign, 10}}},
     {{{kTerrain, 4}}}},
    {RawId::kTerrain,
     0.07,
     0.8,
     0.2,
     false,
     {{{kSidewalk, 86},
       {kTrunk, 36},
       {kVegetation, 19},
       {kOtherGround, 9},
       {kPole, 9},
       {kFence, 2}}}},
    {RawId::kPole,
     0.26,
     0.3,
     0.3,
     true,
     {{{kTrunk, 271}, {kVegetation, 15}, {kSign, 12}}},
     {{{kTerrain, 24}, {kCar, 16}, {kSidewalk, 4}}}},
    {RawId::kTrafficSign, 0.36, 0.4, 0.3, true, {{{kPole, 283}, {kTrunk, 143}, {kVegetation, 16}}}},
    {RawId::kUnlabelled,
     1.0,
     0.0,
     0.0,
     true,
     {{{kVegetation, 234},
       {kTrunk, 207},
       {kBuilding, 134},
       {kPole, 127},
       {kTerrain, 98},
       {kFence, 66},
       {kCar, 32},
       {kOtherGround, 26},
       {kPerson, 10}}}},
}};

const Row& row_of(RawId learned) noexcept {
  for (const Row& row : kRows) {
    if (row.truth == learned) return row;
  }
  return kRows.back();
}

int total_weight(std::span<const Answer> answers) noexcept {
  int total = 0;
  for (const Answer& answer : answers) total += answer.weight;
  return total;
}

/// The answer that covers `at` when the weights are laid end to end; the last one beyond them.
std::uint16_t answer_at(std::span<const Answer> answers, double at) noexcept {
  std::uint16_t said = answers.front().id;
  for (const Answer& answer : answers) {
    if (answer.weight == 0) break;
    said = answer.id;
    at -= answer.weight;
    if (at < 0.0) break;
  }
  return said;
}

}  // namespace

bool is_thing(RawId learned) noexcept { return row_of(learned).thing; }

double mistake_probability(RawId learned, double range_m, double cos_incidence) noexcept {
  const Row& row = row_of(learned);
  const double far = range_m / 30.0;
  const double rate =
      row.rate * (1.0 + row.growth * far * far) * (1.0 + row.lean * (1.0 - cos_incidence));
  return learned == RawId::kUnlabelled ? 1.0 : std::min(rate, 0.85);
}

std::uint16_t mistaken_for(RawId learned, double share) noexcept {
  const Row& row = row_of(learned);
  return answer_at(row.answers, share * total_weight(row.answers));
}

std::uint16_t stray_answer(RawId learned, double share) noexcept {
  const Row& row = row_of(learned);
  const int beside = total_weight(row.border);
  const double at = share * (beside + total_weight(row.answers));
  return at < beside ? answer_at(row.border, at) : answer_at(row.answers, at - beside);
}

}  // namespace tessera::street
