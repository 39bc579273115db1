// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include <catch2/catch.hpp>
#include <functional>

#include "sample_robot.hpp"

namespace tessera {

namespace {

Status status_of(const PublisherConfig& config, std::size_t short_of_bytes = 0) {
  const std::size_t bytes = Publisher::required_bytes(config, 5) - short_of_bytes;
  AlignedMemory memory(bytes);
  Arena arena = memory.arena();
  return Publisher::make(arena, config, MapConfig{}, 5).status();
}

PublisherConfig small() {
  PublisherConfig config;
  config.blocks = 128;
  config.candidates = 64;
  return config;
}

}  // namespace

TEST_CASE("Publisher: is made in exactly the memory that it asks for") {
  CHECK(status_of(small()) == Status::kOk);
  CHECK(status_of(small(), 1) == Status::kResourceExhausted);
}

TEST_CASE("Publisher: settings beyond their range are refused, at it they are not") {
  using Set = std::function<void(PublisherConfig&)>;
  const std::vector<std::pair<Set, bool>> cases{
      {[](auto& c) { c.blocks = 63; }, false},  // under candidates
      {[](auto& c) { c.blocks = 64; }, true},
      {[](auto& c) { c.candidates = 63; }, false},
      {[](auto& c) { c.candidates = 129; }, false},
      {[](auto& c) { c.staleness_us = 999; }, false},
      {[](auto& c) { c.staleness_us = 1000; }, true},
      {[](auto& c) { c.staleness_us = c.free_staleness_us; }, true},
      {[](auto& c) { c.staleness_us = c.free_staleness_us + 1; }, false},
      {[](auto& c) { c.free_staleness_us = 3'600'000'000; }, true},
      {[](auto& c) { c.free_staleness_us = 3'600'000'001; }, false},
      {[](auto& c) { c.retry_us = 0; }, false},
      {[](auto& c) { c.retry_us = 3'600'000'001; }, false},
      {[](auto& c) { c.evidence_factor = 1.0F; }, false},
      {[](auto& c) { c.evidence_factor = 1e6F; }, true},
      {[](auto& c) { c.evidence_factor = 1.1e6F; }, false},
      {[](auto& c) { c.evidence_factor = std::numeric_limits<float>::quiet_NaN(); }, false},
      {[](auto& c) { c.few_voxels = 0; }, false},
      {[](auto& c) { c.many_voxels = 0; }, false},
  };
  for (std::size_t i = 0; i < cases.size(); ++i) {
    CAPTURE(i);
    PublisherConfig config = small();
    cases[i].first(config);
    CHECK(status_of(config) == (cases[i].second ? Status::kOk : Status::kInvalidArgument));
  }
}

}  // namespace tessera
