// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How a report names that in which another robot's configuration differs.
#include <catch2/catch.hpp>

#include "node/node.hpp"

namespace tessera {
namespace {

TEST_CASE("mismatch_text: names each setting that differs, the cap of evidence too") {
  const ConfigurationDetails ours{.resolution_m = 0.2, .prior = 0.001, .max_evidence = 100.0F};
  ConfigurationDetails theirs = ours;
  CHECK(mismatch_text(theirs, ours) == "ids or names of classes differ; give both robots the same");
  theirs.max_evidence = 250.0F;
  CHECK(mismatch_text(theirs, ours) ==
        "max_evidence is 250 there and 100 here; give both robots the same");
  theirs.resolution_m = 0.5;
  CHECK(mismatch_text(theirs, ours) ==
        "resolution_m is 0.5 there and 0.2 here, max_evidence is 250 there and 100 here; give both "
        "robots the same");
  theirs = ours;
  theirs.conflicts = ConflictPolicy::kExclude;
  CHECK(mismatch_text(theirs, ours) ==
        "[security] conflicts is exclude there and alarm here; give both robots the same");
}

}  // namespace
}  // namespace tessera
