// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What was found by fuzzing, and changes of it, through the bodies that were fuzzed: whatever the
// bytes, what the bodies check holds.
#include <algorithm>
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "fuzz/fuzz.hpp"
#include "support/cloud.hpp"
#include "support/random.hpp"

namespace tessera::fuzz {
namespace {

using Bytes8 = std::vector<char>;

std::vector<Bytes8> corpus_of(const std::string& target) {
  std::vector<std::filesystem::path> paths;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::string(TESSERA_FUZZ_CORPUS) + "/" + target))
    paths.push_back(entry.path());
  std::sort(paths.begin(), paths.end());
  std::vector<Bytes8> all;
  for (const std::filesystem::path& path : paths) {
    std::ifstream file(path, std::ios::binary);
    all.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
  }
  return all;
}

void change(Bytes8& bytes, const Bytes8& other, oracle::Random& random) {
  const auto place = [&](const Bytes8& of) {
    return static_cast<std::ptrdiff_t>(random.below(static_cast<int>(of.size()) + 1));
  };
  const int what = random.below(6);
  const std::ptrdiff_t at = place(bytes);
  if (what == 0) {
    bytes.resize(static_cast<std::size_t>(at));
  } else if (what == 1) {
    bytes.insert(bytes.begin() + at, static_cast<char>(random.below(256)));
  } else if (what == 2) {
    // From some place on, another input.
    bytes.resize(static_cast<std::size_t>(at));
    bytes.insert(bytes.end(), other.begin() + place(other), other.end());
  } else if (at < static_cast<std::ptrdiff_t>(bytes.size())) {
    char& byte = bytes[static_cast<std::size_t>(at)];
    if (what == 3) byte = static_cast<char>(byte ^ (1 << random.below(8)));
    if (what == 4) byte = static_cast<char>(random.below(256));
    if (what == 5) byte = static_cast<char>(random.below(2) == 0 ? 0xff : 0);
  }
}

/// In memory of just its size, so that a sanitizer sees what is read beyond it.
void run(void (*body)(Bytes), const Bytes8& input) {
  const Bytes8 exact(input.begin(), input.end());
  body(std::as_bytes(std::span(exact)));
}

void run_over_corpus(const char* target, void (*body)(Bytes), int changed, std::uint64_t seed) {
  const std::vector<Bytes8> corpus = corpus_of(target);
  REQUIRE_FALSE(corpus.empty());
  for (std::size_t i = 0; i < corpus.size(); ++i) {
    INFO("input " << i << " of the corpus, by name");
    run(body, corpus[i]);
  }
  oracle::Random random(oracle::announce_seed(seed));
  const auto any = [&]() -> const Bytes8& {
    return corpus[static_cast<std::size_t>(random.below(static_cast<int>(corpus.size())))];
  };
  for (int i = 0; i < changed; ++i) {
    INFO("changed input " << i);
    Bytes8 input = any();
    for (int changes = 1 + random.below(4); changes > 0; --changes) change(input, any(), random);
    run(body, input);
  }
}

TEST_CASE("fuzz: block codes") { run_over_corpus("block_codec", block_codec, 3000, 601); }
TEST_CASE("fuzz: packed blocks") { run_over_corpus("packed_block", packed_block, 3000, 602); }
TEST_CASE("fuzz: parts of datagrams") { run_over_corpus("wire", wire, 5000, 603); }
TEST_CASE("fuzz: map files and stored blocks") { run_over_corpus("map_file", map_file, 2000, 604); }
TEST_CASE("fuzz: an exchange among hostile robots") {
  run_over_corpus("exchange", exchange, 300, 605);
}
TEST_CASE("fuzz: a team on a hostile network") {
  run_over_corpus("exchange_team", exchange_team, 200, 606);
}
#if TESSERA_FUZZ_PLATFORM
TEST_CASE("fuzz: clouds and their poses") { run_over_corpus("clouds", clouds, 5000, 610); }
TEST_CASE("fuzz: LCM messages, URLs and senders") {
  run_over_corpus("messages", messages, 5000, 607);
}
TEST_CASE("fuzz: depth images, their labels, camera and poses") {
  run_over_corpus("depth_images", depth_images, 1500, 612);
}
TEST_CASE("fuzz: OctoMap's files") { run_over_corpus("octrees", octrees, 20000, 611); }
TEST_CASE("fuzz: sensors' messages, fragments and queries") {
  run_over_corpus("sensors", sensors, 5000, 609);
}
TEST_CASE("fuzz: statuses of robots") { run_over_corpus("status", status, 3000, 613); }
TEST_CASE("fuzz: files of datasets and keys") {
  run_over_corpus("text_files", text_files, 600, 608);
}
TEST_CASE("fuzz: frames of a vehicle's bus") { run_over_corpus("vehicle", vehicle, 3000, 609); }
#endif

}  // namespace
}  // namespace tessera::fuzz
