// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Clouds whose points have labels with weights.
#include <catch2/catch.hpp>

#include "link/sensor_sender.hpp"
#include "unit/lcm/encoded.hpp"
#include "unit/lcm/sample_cloud.hpp"

namespace tessera {
namespace {

/// The same with this number of labels for each point.
tessera_semantic_cloud with_labels(tessera_semantic_cloud cloud, std::int32_t labels) {
  cloud.components = cloud.label_weights = labels * cloud.count;
  cloud.component.clear();
  for (std::int32_t k = 0; k < cloud.components; ++k) {
    cloud.component.push_back(static_cast<std::uint8_t>(k % 250));
    cloud.label_weight.push_back(static_cast<std::uint8_t>(k % 256));
  }
  return cloud;
}

TEST_CASE("decode_semantic_cloud: one to three labels with weights for each point") {
  for (const std::int32_t labels : {1, 2, 3}) {
    const tessera_semantic_cloud cloud = with_labels(sample_cloud(300, true, true), labels);
    Room room(300);
    CloudHeader header;
    REQUIRE(decode_semantic_cloud(encoded(cloud), room.memory(), header) == MessageFault::kNone);
    CHECK(header.has_label_weights);
    CHECK(header.labels_per_point == static_cast<std::uint32_t>(labels));
    CHECK(std::equal(cloud.component.begin(), cloud.component.end(), room.components.begin()));
    CHECK(std::equal(cloud.label_weight.begin(), cloud.label_weight.end(),
                     room.label_weights.begin()));
    CHECK(std::equal(cloud.weight.begin(), cloud.weight.end(), room.weights.begin()));
    CHECK(room.has_marks());
    const std::span<const std::uint8_t> components = room.components;
    const CloudToSend to_send{
        .stamp_us = cloud.stamp_us,
        .sensor = 3,
        .xyz = cloud.xyz,
        .components = components.first(cloud.component.size()),
        .label_weights =
            std::span<const std::uint8_t>(room.label_weights).first(cloud.label_weight.size()),
        .weights = cloud.weight,
        .times_us = cloud.time_us,
        .no_return = std::span<const std::uint8_t>(room.no_return).first(300)};
    CHECK(encode(to_send) == encoded(cloud));
  }
}

TEST_CASE("decode_semantic_cloud: labels that are not as many for each point write nothing") {
  const auto fault_of = [](const tessera_semantic_cloud& cloud) {
    Room room(300);
    CloudHeader header;
    const MessageFault fault = decode_semantic_cloud(encoded(cloud), room.memory(), header);
    CHECK(room.is_untouched());
    return fault;
  };
  CHECK(fault_of(with_labels(sample_cloud(4, false, false), 4)) == MessageFault::kCounts);
  tessera_semantic_cloud uneven = with_labels(sample_cloud(4, false, false), 2);
  for (std::int32_t* const count : {&uneven.components, &uneven.label_weights}) --*count;
  uneven.component.pop_back();
  uneven.label_weight.pop_back();
  CHECK(fault_of(uneven) == MessageFault::kCounts);
  tessera_semantic_cloud bare = with_labels(sample_cloud(4, false, false), 2);
  bare.label_weights = 0;
  bare.label_weight.clear();
  CHECK(fault_of(bare) == MessageFault::kCounts);
  tessera_semantic_cloud none = sample_cloud(4, false, false);
  none.components = 0;
  none.component.clear();
  CHECK(fault_of(none) == MessageFault::kCounts);
  CHECK(fault_of(with_labels(sample_cloud(301, false, false), 3)) == MessageFault::kTooLarge);
}

}  // namespace
}  // namespace tessera
