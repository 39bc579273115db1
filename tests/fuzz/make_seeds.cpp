// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// make_seeds FOLDER: what the real encoders give, as inputs to begin fuzzing with, a folder for
// each target. The same bytes every time.
#include <array>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <string>
#include <string_view>
#include <vector>

#include "fuzz/file_seeds.hpp"
#include "fuzz/forged_datagram.hpp"
#include "fuzz/sensor_seeds.hpp"
#include "network/simulated_network.hpp"
#include "support/sample_content.hpp"
#include "tessera/exchange/internal/block_codec.hpp"
#include "tessera/map/internal/packed_block.hpp"
#include "tessera/map/stored_block.hpp"

namespace tessera::fuzz {
namespace {

using oracle::Random;

/// An input, number by number.
struct Seed {
  Datagram bytes{};
  Seed& u8(unsigned value) {
    bytes.push_back(static_cast<std::byte>(value));
    return *this;
  }
  Seed& u16(std::size_t value) {
    return u8(static_cast<unsigned>(value & 0xffU)).u8(static_cast<unsigned>(value >> 8U));
  }
  Seed& all(Bytes more) {
    bytes.insert(bytes.end(), more.begin(), more.end());
    return *this;
  }
  Seed& text(std::string_view more) { return all(std::as_bytes(std::span(more))); }
};

class Corpus {
 public:
  explicit Corpus(std::filesystem::path folder) : folder_(std::move(folder)) {}
  void add(const std::string& target, const Seed& seed) {
    const std::filesystem::path of_target = folder_ / target;
    std::filesystem::create_directories(of_target);
    std::ofstream file(of_target / ("seed_" + std::to_string(count_++)), std::ios::binary);
    for (const std::byte byte : seed.bytes) file.put(static_cast<char>(byte));
  }

 private:
  std::filesystem::path folder_;
  int count_ = 0;
};

void blocks(Corpus& corpus) {
  Random random(1);
  for (int i = 0; i < 24; ++i) {
    const int num_components = 3 + random.below(18);
    OwnContent content(num_components);
    if (i % 3 == 0) {
      const double part = 0.01 * (1 << random.below(6));
      fill_at_random(*content, random, num_components, 5, part);
    } else {
      fill_smoothly(*content, random, num_components);
    }
    std::vector<std::byte> packed(most_packed_bytes(num_components));
    packed.resize(pack_block(*content, packed));
    Seed whole;
    corpus.add("packed_block",
               whole.u8(0).u8(static_cast<unsigned>(num_components - 3)).all(packed));
    quantise(*content);
    const auto layers = static_cast<unsigned>(i % 4 == 0 ? 14 : random.below(15));
    Seed code;
    code.u8(layers).u8(static_cast<unsigned>(num_components - 3)).all(coded(*content, layers + 1));
    corpus.add("block_codec", code);
    for (const char* target : {"block_codec", "packed_block"}) {
      Seed drawn;
      drawn.u8(0x11U + static_cast<unsigned>(random.below(15)));
      for (int n = random.below(200); n > 0; --n)
        drawn.u8(static_cast<unsigned>(random.below(256)));
      corpus.add(target, drawn);
    }
  }
}

/// What robots say while they find each other.
std::vector<Datagram> spoken(bool with_signatures) {
  network::Network network(2, {.loss = 0.2}, 2, network::Network::default_replicas(), {},
                           with_signatures);
  std::vector<Datagram> said;
  Datagram datagram(kMostDatagramBytes);
  for (int tick = 0; tick < 300; ++tick) {
    if (tick % 60 == 0) {
      const int voxels = tick == 240 ? 3000 : 3 + tick / 10;
      static_cast<void>(
          network.robot(tick % 2).publish(*pack({tick, -1, 0}), network.random(), voxels));
    }
    for (int from = 0; from < 2; ++from) {
      const std::int64_t now_us = tick * network::kTickUs;
      while (const std::size_t size = network.robot(from).exchange().send(now_us, datagram)) {
        said.emplace_back(datagram.begin(), datagram.begin() + static_cast<std::ptrdiff_t>(size));
        if (network.random().below(4) != 0)
          network.robot(1 - from).exchange().receive(said.back(), now_us);
      }
    }
  }
  return said;
}

void datagrams(Corpus& corpus, bool with_signatures) {
  // Of each kind its part in the body "wire".
  constexpr std::array<unsigned, 10> kParts{0, 1, 2, 3, 7, 0, 4, 5, 6, 8};
  std::array<int, 128> of_kind{};
  for (const Datagram& datagram : spoken(with_signatures)) {
    const unsigned kind = std::to_integer<unsigned>(datagram[3]) & 0x7fU;
    if (of_kind[kind]++ >= 5) continue;
    const Bytes body =
        Bytes(datagram).subspan(kHeaderBytes, datagram.size() - kHeaderBytes - kTagBytes);
    corpus.add("wire", Seed().u8(0).all(Bytes(datagram).first(kHeaderBytes)));
    Seed one;
    if (kind < kParts.size()) corpus.add("wire", one.u8(kParts[kind]).all(body));
    // As it is, then from one who has the key, before and after the frame of its contribution.
    Seed heard;
    heard.u8((kind & 1U) + (with_signatures ? 2U : 0U));
    heard.u8(0).u16(datagram.size()).all(datagram);
    heard.u8(1).u8(kind).u8(7).u8(1).u16(body.size()).all(body);
    const Datagram frame = relayed_frame(body, with_signatures);
    heard.u8(1).u8(4).u8(7).u8(1).u16(frame.size()).all(frame);
    heard.u8(1).u8(kind).u8(7).u8(1).u16(body.size()).all(body).u8(4).u8(0);
    corpus.add("exchange", heard);
    Seed message;
    corpus.add("messages",
               message.u8(0).text({"LC02\0\0\0\7TESSERA\0", 16}).all(body.first(body.size() / 8)));
  }
}

/// Steps drawn at random, those that lead somewhere more often.
void programs(Corpus& corpus) {
  Random random(3);
  for (int i = 0; i < 40; ++i) {
    Seed one;
    one.u8(static_cast<unsigned>(i) & 3U);
    for (int steps = 5 + random.below(60); steps > 0; --steps) {
      constexpr std::array<unsigned, 12> kSteps{2, 3, 4, 5, 6, 8, 8, 6, 8, 3, 7, 8};
      one.u8(kSteps[static_cast<std::size_t>(random.below(12))]);
      for (int n = 2 + random.below(3); n > 0; --n)
        one.u8(static_cast<unsigned>(random.below(256)));
    }
    corpus.add("exchange", one);
    Seed team;
    team.u8(static_cast<unsigned>(random.below(2)) + (i % 2 == 0 ? 0x80U : 0U));
    for (int steps = 3 + random.below(40); steps > 0; --steps) {
      for (int n = 4; n > 0; --n) team.u8(static_cast<unsigned>(random.below(256)));
    }
    corpus.add("exchange_team", team);
  }
}

/// Contradictions about one contribution: where it is, what it has, who wants it.
void lies(Corpus& corpus) {
  constexpr unsigned kLie = 8;
  Random random(5);
  for (int i = 0; i < 60; ++i) {
    // Of a stranger, of a friend, of the victim itself.
    constexpr std::array<unsigned, 4> kIds{0x03, 0x02, 0x09, 0x05};
    const unsigned id = kIds[static_cast<std::size_t>(i) % kIds.size()];
    const auto any = [&random](int below) { return static_cast<unsigned>(random.below(below)); };
    Seed seed;
    seed.u8((i % 5 == 0 ? 1U : 0U) + (i % 2 == 0 ? 2U : 0U));
    for (int step = 0; step < 24; ++step) {
      const unsigned what = step == 0 ? 0 : any(7);
      const unsigned sender = 0x60;
      if (what == 0) {
        const unsigned revision = any(3);
        seed.u8(kLie).u8(sender | 3U).u8(id).u8(revision).u8(0).u16(any(2)).u16(0).u16(0);
      } else if (what <= 2) {
        const unsigned first = 1 + any(4);
        seed.u8(kLie).u8(sender | 2U).u8(id).u8(first).u8(any(6)).u8(2);
        for (int record = 0; record < 2; ++record) {
          const unsigned how = 16 * any(15) + any(2);
          seed.u8(how).u8(any(64));
        }
      } else if (what == 3) {
        seed.u8(kLie).u8(sender | 1U).u8(1).u8(id).u8(0x21).u8(1).u8(any(9));
      } else if (what == 4) {
        const unsigned latest = any(10);
        seed.u8(kLie).u8(sender).u8(1).u8(id).u8(latest).u8(0x10U + any(4));
      } else {
        seed.u8(3).u8(0x7f);
        for (int sent = 0; sent < 4; ++sent) seed.u8(4).u8(0);
      }
    }
    corpus.add("exchange", seed);
  }
}

bool append(void* context, std::span<const std::byte> more) {
  static_cast<Seed*>(context)->all(more);
  return true;
}

void maps(Corpus& corpus) {
  Random random(4);
  for (int i = 0; i < 12; ++i) {
    const int classes = 1 + random.below(4);
    MapConfig config = oracle::uncapped_map(0.1);
    config.tuple = i % 2 == 0 ? TuplePolicy::kDense : TuplePolicy::kCompact;
    config.storage_bytes = std::size_t{1} << 18U;
    config.label_votes = i % 3 == 1;
    AlignedMemory memory(required_bytes(config));
    Arena arena(memory.span());
    LocalMap map = std::move(*LocalMap::make(arena, config, oracle::numbered_classes(classes)));
    for (int voxels = random.below(30); voxels > 0; --voxels) {
      const BlockCoord coord{random.below(12) / 8, random.below(2), 0};
      const SlabHandle block = *map.open_block(coord);
      const std::array<std::byte, kOctetVoxels> free{static_cast<std::byte>(random.below(3) + 1)};
      const int octet = random.below(kBlockOctets);
      VoxelEvidence evidence;
      evidence.num_components = classes + 2;
      evidence.sigma[static_cast<std::size_t>(1 + random.below(classes + 1))] = 0.25F;
      static_cast<void>(map.merge(block, octet, random.below(8), evidence, 0));
      if (config.label_votes) static_cast<void>(map.begun_votes(block, layer_of_octet(octet)));
      const unsigned unlabelled = ~unsigned{map.observed_labels(map.block_at(block), octet)};
      if (random.below(2) == 0)
        static_cast<void>(map.merge_passes(block, octet, free, unlabelled & 1U));
    }
    MapIdentity identity;
    identity.has_T_global_map = i % 3 == 0;
    std::vector<KeyedIndex> workspace(2 * map.block_count());
    MapFileBuffer buffer;
    Seed file;
    file.u8(1);
    static_cast<void>(save(map, identity, workspace, buffer, {&file, &append}));
    corpus.add("map_file", file);
    if (map.find({0, 0, 0}) == nullptr) continue;
    std::vector<std::byte> coded(most_block_bytes(map.num_components()));
    coded.resize(save_block(map, *map.find({0, 0, 0}), coded));
    Seed stored;
    const unsigned how = 3U + (i % 2 == 0 ? 0U : 4U) + (static_cast<unsigned>(classes - 1) << 3U) +
                         (config.label_votes ? 128U : 0U);
    corpus.add("map_file", stored.u8(how).all(coded));
  }
}

void texts(Corpus& corpus) {
  const auto add = [&](const char* target, unsigned kind, std::string_view text) {
    Seed seed;
    corpus.add(target, seed.u8(kind).text(text));
  };
  add("messages", 1, "udpm://239.255.76.67:7667?ttl=1&recv_buf_size=4194304");
  add("messages", 1, "udpm://224.0.0.1:1?ttl=255");
  add("messages", 2, {"\1\0\0\0\0\1\2\0\0\0\2\0\0\0\0\1\377\0\0\0\1\0\0\0\0", 25});
  add("messages", 0, {"LC03\0\0\0\7abc", 11});
  add("text_files", 0, "1 0 0 0 0 1 0 0 0 0 1 0\n\n+1 0 0 1e-3 0 1 0 nan 0 0 1 -inf\r\n");
  add("text_files", 1, "P0: 1 2\nTr: 1 0 0 0.1 0 1 0 0 0 0 1 0\n");
  add("text_files", 2, "1 0 0 0.5\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
  add("text_files", 3,
      "unlabelled = [0, 1]\n[[class]]\nid = 1\nname = \"car\"\ncolor = [255, 0, 1]\nraw = [10]\n"
      "[[class]]\nid = 2\nname = \"road\"\ncolor = \"#ff00a0\"\nraw = [40, 65535]\n");
  const std::string key(64, '5');
  add("text_files", 5, "# a\ntessera-fleet-key 1 " + key + " 00000000\n");
  add("text_files", 6, "# a\ntessera-fleet-key 1 " + key + " 00000000\n");
  add("text_files", 7, "tessera-robot-secret 1 7 " + key + " 00000000\n");
  add("text_files", 8,
      "tessera-robot-public 1 7 " + key + " 00000000\ntessera-robot-public 1 3 " + key +
          " 11111111\n");
  Seed dataset;
  dataset.u8(4).u16(32).u16(8).text(std::string(32, '\1')).text({"\12\0\0\0\50\0\1\0", 8});
  corpus.add("text_files", dataset.text("1 0 0 0 0 1 0 0 0 0 1 0\n"));
}

}  // namespace
}  // namespace tessera::fuzz

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "make_seeds FOLDER\n";
    return 1;
  }
  tessera::fuzz::Corpus corpus(argv[1]);
  tessera::fuzz::blocks(corpus);
  for (const bool with_signatures : {false, true})
    tessera::fuzz::datagrams(corpus, with_signatures);
  tessera::fuzz::programs(corpus);
  tessera::fuzz::lies(corpus);
  tessera::fuzz::maps(corpus);
  tessera::fuzz::texts(corpus);
  const auto add_all = [&](const char* target, const std::vector<std::vector<std::byte>>& inputs) {
    for (const auto& input : inputs) corpus.add(target, tessera::fuzz::Seed().all(input));
  };
  add_all("sensors", tessera::fuzz::sensor_seeds());
  add_all("status", tessera::fuzz::status_seeds());
  add_all("wire", tessera::fuzz::frame_seeds());
  add_all("depth_images", tessera::fuzz::image_seeds());
  add_all("text_files", tessera::fuzz::toml_seeds());
}
