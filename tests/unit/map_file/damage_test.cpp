// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Damage of every kind at every place of a small file: refused as what it is, and the map is left
// empty.
#include <catch2/catch.hpp>

#include "stored_bytes.hpp"
#include "support/sample_map.hpp"

namespace tessera {

namespace {

bool tells_damage(Status status) {
  return status == Status::kTruncated || status == Status::kCorrupt ||
         status == Status::kUnsupported;
}

/// Something of everything: labels and free passes in one block, labels alone, free passes alone.
StoredBytes small_file() {
  SmallMap sample(config_of_pages(8), kSampleClasses);
  sample.map.begin_revision();
  observe(sample.map, {{{0, 0, 0}, 1, 1.0F},
                       {{0, 0, 0}, 4, 0.5F},
                       {{1, 0, 0}, 2, 2.0F},
                       {{0, 3, 0}, 0},
                       {{-20, 4, 4}, 3, 0.25F},
                       {{30, 30, -30}, 0}});
  return stored(sample.map);
}

/// Tries to load damaged bytes into a map with just the storage that the sound ones need.
class DamageTrial {
 public:
  DamageTrial() : map_(header_of(bytes_).config, header_of(bytes_).classes) {}
  const StoredBytes& bytes() const { return bytes_; }
  void refuses(std::span<const std::byte> damaged) {
    const MapFileStatus status = read_into(damaged, map_.map);
    INFO(status.what << ", " << to_string(status.status) << " at byte " << status.offset_bytes);
    const bool refused = tells_damage(status.status);
    const bool says_what = status.what[0] != '\0';
    const bool empty = map_.map.block_count() == 0 && map_.map.usage().label_voxels == 0;
    CHECK(refused);
    CHECK(says_what);
    CHECK(empty);
    CHECK(status.offset_bytes <= damaged.size());
    map_.map.clear();
  }

 private:
  static MapFileHeader header_of(const StoredBytes& bytes) {
    MapFileHeader header;
    REQUIRE(read_header(bytes, header).ok());
    return header;
  }
  StoredBytes bytes_ = small_file();
  LoadedMap map_;
};

}  // namespace

TEST_CASE("a file cut at any length is refused") {
  DamageTrial trial;
  for (std::size_t length = 0; length < trial.bytes().size(); ++length) {
    INFO("cut to " << length << " of " << trial.bytes().size() << " bytes");
    trial.refuses(std::span(trial.bytes()).first(length));
  }
}

TEST_CASE("a file with any one bit flipped is refused") {
  DamageTrial trial;
  StoredBytes damaged = trial.bytes();
  for (std::size_t at = 0; at < damaged.size(); ++at) {
    for (unsigned bit = 0; bit < 8; ++bit) {
      INFO("bit " << bit << " of byte " << at << " of " << damaged.size());
      damaged[at] ^= static_cast<std::byte>(1U << bit);
      trial.refuses(damaged);
      damaged[at] = trial.bytes()[at];
    }
  }
}

TEST_CASE("a file with any one byte inverted or zeroed is refused") {
  DamageTrial trial;
  StoredBytes damaged = trial.bytes();
  for (std::size_t at = 0; at < damaged.size(); ++at) {
    INFO("byte " << at << " of " << damaged.size());
    damaged[at] = ~trial.bytes()[at];
    trial.refuses(damaged);
    damaged[at] = std::byte{0};
    if (damaged[at] != trial.bytes()[at]) trial.refuses(damaged);
    damaged[at] = trial.bytes()[at];
  }
}

TEST_CASE("a file with more after its end is refused") {
  DamageTrial trial;
  StoredBytes longer = trial.bytes();
  longer.push_back(std::byte{0});
  trial.refuses(longer);
  StoredBytes twice = trial.bytes();
  twice.insert(twice.end(), trial.bytes().begin(), trial.bytes().end());
  trial.refuses(twice);
}

TEST_CASE("a file with any piece of eight bytes missing is refused") {
  DamageTrial trial;
  for (std::size_t at = 0; at + 8 < trial.bytes().size(); ++at) {
    INFO("without the bytes from " << at);
    StoredBytes shorter = trial.bytes();
    const auto from = shorter.begin() + static_cast<std::ptrdiff_t>(at);
    shorter.erase(from, from + 8);
    trial.refuses(shorter);
  }
}

TEST_CASE("random bytes are refused") {
  DamageTrial trial;
  SampleRandom random(11);
  for (int i = 0; i < 200; ++i) {
    StoredBytes noise(static_cast<std::size_t>(random.integer(0, 3000)));
    for (std::byte& b : noise) b = static_cast<std::byte>(random.integer(0, 255));
    trial.refuses(noise);
  }
}

}  // namespace tessera
