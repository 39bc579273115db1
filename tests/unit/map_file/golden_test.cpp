// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Values that must not change by accident. If one of these does:
// - the digest: maps of older versions no longer compare equal to new ones, and every digest that
//   was ever noted down is void. Say so in the release notes.
// - the file's bytes alone: the bytes written for the same map changed. Older files must still
//   load; count the minor version up if the header grew, the major one if older readers would fail.
#include <algorithm>
#include <catch2/catch.hpp>
#include <string_view>

#include "stored_bytes.hpp"
#include "support/digest_by_rows.hpp"
#include "support/sample_map.hpp"
#include "tessera/base/internal/digest.hpp"

namespace tessera {

namespace {

/// Every value exact in binary, so that it is the same on every machine.
LoadedMap fixed_map() {
  ClassTable classes;
  REQUIRE(classes.add("road", {128, 64, 128}) == Status::kOk);
  REQUIRE(classes.add("building", {70, 70, 70}) == Status::kOk);
  REQUIRE(classes.add("car", {0, 0, 142}) == Status::kOk);
  MapConfig config = config_of_pages(8);
  config.resolution_m = 0.125;
  config.prior = 0.0009765625;
  config.max_evidence = 64.0F;
  config.free_weight = 0.5F;
  LoadedMap fixed(config, classes);
  fixed.map.begin_revision();
  observe(fixed.map, {{{0, 0, 0}, 1, 1.0F},
                      {{0, 0, 0}, 3, 0.25F},
                      {{-1, -9, 17}, 2, 2.5F},
                      {{-1, -9, 17}, 0},
                      {{5, 6, 7}, 4, 0.75F},
                      {{40, 0, 0}, 0}});
  return fixed;
}

}  // namespace

TEST_CASE("the digest of a fixed map is the one it has always been") {
  const LoadedMap fixed = fixed_map();
  CHECK(digest_of(fixed.map) == 0xbf4f260af3e73105U);
  CHECK(oracle::digest_by_rows(fixed.map) == 0x9ce1db6fd026c0beU);
}

TEST_CASE("the file of a fixed map is the one it has always been") {
  MapIdentity identity{.robot = 3, .epoch = 2};
  identity.has_T_global_map = true;
  identity.T_global_map(0, 3) = 12.5;
  constexpr std::string_view kSettings = "{}";
  std::copy(kSettings.begin(), kSettings.end(), identity.settings.begin());
  identity.settings_bytes = kSettings.size();
  const StoredBytes bytes = stored(fixed_map().map, identity);
  CHECK(bytes.size() == 1456U);
  // Not a CRC: that of parts which end in their own is the same whatever they hold.
  Digest all;
  for (const std::byte byte : bytes) all.add(std::to_integer<std::uint64_t>(byte));
  CHECK(all.value() == 0xdddb14bf9366b28dU);
}

}  // namespace tessera
