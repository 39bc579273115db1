// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The property test of integration: random scans with every special float, under every kind of
// scarcity. TESSERA_PROPERTY_CASES and TESSERA_PROPERTY_SEED set another number of scans and
// another seed; see docs/design/testing.md.
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <catch2/catch.hpp>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <set>

#include "laws/scan_laws.hpp"

#if defined(__has_feature)
#if __has_feature(address_sanitizer)
#define TESSERA_HAS_DEATH_CALLBACK
#endif
#elif defined(__SANITIZE_ADDRESS__)
#define TESSERA_HAS_DEATH_CALLBACK
#endif
#ifdef TESSERA_HAS_DEATH_CALLBACK
#include <sanitizer/common_interface_defs.h>
#endif

namespace tessera::oracle {
namespace {

/// The cases are shared out among so many tests, which ctest runs side by side.
constexpr int kShares = 8;
constexpr std::uint64_t kDefaultCases = 20000;
constexpr std::uint64_t kDefaultSeed = 19;
/// Of the maps of each share, with the default seed and number of cases. A change of what is
/// admitted, cut or written changes them; builds must agree, with asserts and without.
constexpr std::array<std::uint64_t, kShares> kGolden{
    0xf31bc19ef85b9ebcU, 0xfe7c993bd5ed1fd6U, 0x4e12d95ffe019bbdU, 0x3fabac8debe708faU,
    0x2f581e44a09f0e95U, 0xa09cc4c0e90b34fcU, 0xc3a394f189e6ae9dU, 0x0705d2a12833f4deU};

std::uint64_t number_from(const char* variable, std::uint64_t otherwise) {
  const char* const given = std::getenv(variable);
  return given == nullptr ? otherwise : std::strtoull(given, nullptr, 10);
}

/// In a process of its own, so that failed asserts and sanitizers end that alone.
bool fails(const ScanCase& scan_case) {
  std::fflush(nullptr);
  const pid_t child = fork();
  if (child == 0) {
    std::signal(SIGABRT, SIG_DFL);
#ifdef TESSERA_HAS_DEATH_CALLBACK
    __sanitizer_set_death_callback([] { _exit(1); });
#endif
    if (std::freopen("/dev/null", "w", stderr) == nullptr) _exit(2);
    Digest digest;
    CaseTally tally;
    _exit(broken_law(scan_case, digest, tally) ? 1 : 0);
  }
  int status = 0;
  if (child < 0 || waitpid(child, &status, 0) != child) return false;
  return !(WIFEXITED(status) && WEXITSTATUS(status) == 0);
}

/// Without every return whose removal leaves the failure.
ScanCase shrunk(ScanCase scan_case) {
  ScanCase less = scan_case;
  less.before.clear();
  if (fails(less)) scan_case = less;
  for (const auto scan : {&ScanCase::before, &ScanCase::returns}) {
    for (std::size_t i = (scan_case.*scan).size(); i-- > 0;) {
      less = scan_case;
      (less.*scan).erase((less.*scan).begin() + static_cast<std::ptrdiff_t>(i));
      if (fails(less)) scan_case = less;
    }
  }
  return scan_case;
}

const ScanCase* case_at_hand = nullptr;

/// For ends that cannot be returned from: asserts and sanitizers.
void print_case_at_hand() {
  if (case_at_hand == nullptr) return;
  const ScanCase scan_case = *case_at_hand;
  case_at_hand = nullptr;
  std::cerr << "minimal reproduction: " << text_of(shrunk(scan_case)) << std::flush;
}

extern "C" void on_abort(int /*signal*/) {
  print_case_at_hand();
  std::signal(SIGABRT, SIG_DFL);
  std::abort();
}

struct Outcome {
  std::uint64_t digest = 0;
  std::uint64_t failed = 0;
  CaseTally tally{};
};

/// By turns a row of the covering, for each pair of levels, and one at random, for more than pairs.
Row row_of(std::uint64_t i, const std::vector<Row>& rows, std::uint64_t seed) {
  const std::uint64_t turn = i / kShares;
  if (turn % 2 == 0) return rows[turn / 2 % rows.size()];
  Random random(mix64(~seed + (i << 32U)));
  Row row;
  for (std::size_t f = 0; f < row.size(); ++f) row[f] = random.below(kLevels[f]);
  return row;
}

Outcome run_share(int share, std::uint64_t cases, std::uint64_t seed,
                  Carving carving = Carving::kRays) {
  const std::vector<Row> rows = covering_rows();
  Digest digest;
  Outcome outcome;
  const auto old_handler = std::signal(SIGABRT, on_abort);
#ifdef TESSERA_HAS_DEATH_CALLBACK
  __sanitizer_set_death_callback(print_case_at_hand);
#endif
  for (std::uint64_t i = static_cast<std::uint64_t>(share); i < cases; i += kShares) {
    ScanCase scan_case = make_case(row_of(i, rows, seed), mix64(seed + (i << 32U)));
    scan_case.inference.free_space.carving = carving;
    case_at_hand = &scan_case;
    const std::optional<std::string> broken = broken_law(scan_case, digest, outcome.tally);
    case_at_hand = nullptr;
    if (!broken) continue;
    if (++outcome.failed <= 3) {
      UNSCOPED_INFO("case " << i << " of seed " << seed << ": " << *broken
                            << "\nminimal reproduction: " << text_of(shrunk(scan_case)));
    } else {
      std::cout << "case " << i << ": " << *broken << '\n';
    }
  }
  std::signal(SIGABRT, old_handler);
  outcome.digest = digest.value();
  return outcome;
}

}  // namespace

TEST_CASE("property: each pair of levels of two factors is among the rows") {
  const std::vector<Row> rows = covering_rows();
  CHECK(rows.size() <= kDefaultCases / kShares / 2);  // each share runs all of them
  for (std::size_t f = 0; f < kLevels.size(); ++f) {
    for (std::size_t g = f + 1; g < kLevels.size(); ++g) {
      std::set<std::array<int, 2>> pairs;
      for (const Row& row : rows) {
        REQUIRE((row[f] >= 0 && row[f] < kLevels[f]));
        pairs.insert({row[f], row[g]});
      }
      CHECK(pairs.size() == static_cast<std::size_t>(kLevels[f] * kLevels[g]));
    }
  }
}

TEMPLATE_TEST_CASE_SIG("property: scans with special floats and scarce means keep the laws", "",
                       ((int share), share), 0, 1, 2, 3, 4, 5, 6, 7) {
  const std::uint64_t cases = number_from("TESSERA_PROPERTY_CASES", kDefaultCases);
  const std::uint64_t seed = announce_seed(number_from("TESSERA_PROPERTY_SEED", kDefaultSeed));
  const Outcome outcome = run_share(share, cases, seed);
  std::cout << "share " << share << " of " << cases << " cases: digest 0x" << std::hex
            << outcome.digest << std::dec << ", left out something in " << outcome.tally.left_out
            << " scans, cut " << outcome.tally.cut << ", points kept " << outcome.tally.kept_points
            << ", voxels freed " << outcome.tally.freed_voxels << '\n';
  CHECK(outcome.failed == 0);
  if (cases != kDefaultCases || seed != kDefaultSeed) return;
  CHECK(outcome.tally.left_out > 300);
  CHECK(outcome.tally.cut > 30);
  CHECK(outcome.digest == kGolden[static_cast<std::size_t>(share)]);
}

TEST_CASE("property: the same by the image of the scan, but for what returns left out free") {
  const std::uint64_t cases = number_from("TESSERA_PROPERTY_CASES", kDefaultCases) / 16;
  const std::uint64_t seed = announce_seed(number_from("TESSERA_PROPERTY_SEED", kDefaultSeed));
  const Outcome outcome = run_share(0, cases, seed, Carving::kImage);
  std::cout << cases / kShares << " cases by the image: left out something in "
            << outcome.tally.left_out << " scans, cut " << outcome.tally.cut << ", voxels freed "
            << outcome.tally.freed_voxels << '\n';
  CHECK(outcome.failed == 0);
  CHECK(outcome.tally.freed_voxels > 0);
}

}  // namespace tessera::oracle
