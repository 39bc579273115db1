// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Memory of scans is used again: what one had of labels with weights is not the next one's.
#include <catch2/catch.hpp>

#include "unit/sensing/port_bench.hpp"

namespace tessera {
namespace {

std::vector<std::byte> cloud_message(std::int64_t stamp_us, std::size_t labels) {
  const std::vector<float> xyz(6, 1.0F);
  const std::vector<std::uint8_t> components(2 * std::max<std::size_t>(labels, 1), 3);
  const std::vector<std::uint8_t> weights(2 * labels, 40);
  return encode(CloudToSend{
      .stamp_us = stamp_us, .xyz = xyz, .components = components, .label_weights = weights});
}

}  // namespace

TEST_CASE("SensorPort: labels with weights, and without in the same memory afterwards") {
  if (!enter_own_network()) return;
  SensorPortConfig config = port_config();
  config.matcher.slot.weighted_labels = kMostLabels;
  config.matcher.pending_scans = config.matcher.handed_scans = 1;  // Memory comes around soon.
  const auto port = open_port(config);
  const auto sender = open_sender();
  const std::int64_t now_us = port->stamp_now_us();
  REQUIRE(sender->send("TESSERA_POSE", pose_message(now_us - 10'000, 1)));
  REQUIRE(sender->send("TESSERA_POSE", pose_message(now_us, 2)));
  std::int64_t stamp_us = now_us - 9'000;
  for (const std::size_t labels : {3U, 0U, 2U, 1U, 0U, 3U, 0U, 0U}) {
    REQUIRE(sender->send("TESSERA_SEMANTIC_CLOUD", cloud_message(++stamp_us, labels)));
    REQUIRE(eventually_stepped(*port, [&] { return port->front() != nullptr; }));
    const ScanView view = port->front()->view();
    CHECK(view.count == 2);
    CHECK(view.labels_per_point == std::max<std::size_t>(labels, 1));
    CHECK((view.label_weights != nullptr) == (labels > 0));
    if (labels > 0) CHECK(view.label_weights[2 * labels - 1] == 40);
    port->pop();
  }
}

TEST_CASE("SensorPort: more labels than there is memory for are refused, and counted") {
  if (!enter_own_network()) return;
  const auto port = open_port(port_config());  // Without memory for weights.
  const auto sender = open_sender();
  REQUIRE(sender->send("TESSERA_SEMANTIC_CLOUD", cloud_message(port->stamp_now_us(), 1)));
  REQUIRE(eventually_stepped(*port, [&] {
    return port->report().faults[static_cast<std::size_t>(MessageFault::kTooLarge)] == 1;
  }));
  CHECK(port->front() == nullptr);
}

}  // namespace tessera
