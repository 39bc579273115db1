// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// write_blocks FILE: coded blocks and what decoding them gives, as text that decode_block.py holds
// its own decoding against: surfaces, random content, mutated codes, and a map of a simulated
// street.
#include <cstdio>

#include "simulator/street_simulator.hpp"
#include "support/mapper.hpp"
#include "support/sample_content.hpp"
#include "tessera/exchange/internal/evidence_levels.hpp"
#include "tessera/map/internal/packed_block.hpp"

namespace {

using tessera::oracle::Random;

constexpr int kClasses = 19;
constexpr int kComponents = tessera::kMaxComponents;

/// "block LAYERS COMPONENTS HEX", then a line for each voxel with evidence, or "corrupt".
class Writer {
 public:
  explicit Writer(std::FILE* file) : file_(file) {}

  void write(tessera::BlockContent& content, unsigned layers) {
    tessera::quantise(content);
    write_code(tessera::coded(content, layers), layers);
  }
  void write_code(const tessera::CodedBytes& bytes, unsigned layers) {
    std::fprintf(file_, "block %u %d ", layers, kComponents);
    for (const std::byte byte : bytes) std::fprintf(file_, "%02x", std::to_integer<unsigned>(byte));
    std::fprintf(file_, "\n");
    found_->clear();
    if (tessera::decode_block(bytes, layers, kComponents, *found_) != tessera::Status::kOk) {
      std::fprintf(file_, "corrupt\n");
      return;
    }
    for (int octet = 0; octet < tessera::kBlockOctets; ++octet) {
      for (int v = 0; v < tessera::kOctetVoxels; ++v) write_voxel(octet, v);
    }
  }

 private:
  void write_voxel(int octet, int v) {
    const int row = tessera::row_order(octet, v);
    bool any = found_->rest(row) > 0.0F || found_->passes(row) > 0;
    for (int l = 1; l < kComponents; ++l) any = any || found_->count(l, row) > 0.0F;
    if (!any) return;
    std::fprintf(file_, "%d %d", octet, v);
    for (int l = 1; l < kComponents; ++l) {
      if (found_->count(l, row) > 0.0F)
        std::fprintf(file_, " %d:%.9g", l, static_cast<double>(found_->count(l, row)));
    }
    if (found_->rest(row) > 0.0F)
      std::fprintf(file_, " rest:%.9g", static_cast<double>(found_->rest(row)));
    if (found_->passes(row) > 0) std::fprintf(file_, " passes:%u", found_->passes(row));
    if (found_->centroid(row).known()) {
      const std::array<int, 3> levels = found_->centroid(row).levels();
      std::fprintf(file_, " centroid:%d,%d,%d", levels[0], levels[1], levels[2]);
    }
    std::fprintf(file_, "\n");
  }

  std::FILE* file_;
  tessera::OwnContent found_{kComponents};
};

void write_made_up(Writer& writer) {
  Random random(7);
  tessera::OwnContent own(kComponents);
  for (int i = 0; i < 200; ++i) {
    own->clear();
    if (i % 4 != 3) fill_smoothly(*own, random, kComponents);
    if (i % 4 > 1)
      fill_at_random(*own, random, kComponents, 6, i % 8 == 7 ? 1.0 : random.uniform(0.0, 0.2));
    const unsigned layers =
        i % 3 == 0 ? tessera::kAllLayers : 1U + static_cast<unsigned>(random.below(15));
    writer.write(*own, layers);
    tessera::CodedBytes bytes = tessera::coded(*own, layers);
    if (bytes.empty()) continue;
    bytes[static_cast<std::size_t>(random.below(static_cast<int>(bytes.size())))] ^= std::byte{4};
    // Where those were coded plainly, only the encoder knows whether these should be.
    if (bytes[0] != std::byte{0} || bytes[1] > std::byte{15}) writer.write_code(bytes, layers);
  }
}

/// Layers of nothing likely, which are coded plainly.
bool write_unlikely(Writer& writer) {
  Random random(11);
  std::size_t plain = 0;
  for (int i = 0; i < 20; ++i) {
    tessera::OwnContent own(kComponents);
    for (int row = 0; row < tessera::kLayerVoxels; ++row) {
      const int level = 21 + random.below(tessera::kMostLevel - 20);
      own->set(1 + random.below(20), row, tessera::count_of_level(level));
      own->set(21 + random.below(20), row, tessera::count_of_level(level - 20));
      own->set(41 + random.below(22), row, tessera::count_of_level(level - random.below(20)));
      own->add_rest(row, tessera::count_of_level(1 + random.below(tessera::kMostLevel)));
      own->add_passes(row, tessera::passes_of_level(1 + random.below(tessera::kMostPassesLevel)));
    }
    writer.write(*own, 1);
    const tessera::CodedBytes bytes = tessera::coded(*own, 1);
    plain += bytes[0] == std::byte{0} && bytes[1] < std::byte{16} ? 1U : 0U;
  }
  return plain > 0;
}

bool write_street(Writer& writer) {
  const auto street = tessera::StreetSimulator::make({.scans = 4});
  if (!street.ok()) return false;
  tessera::InferenceConfig inference;
  inference.max_range_m = 15.0F;
  tessera::oracle::Mapper mapper(tessera::oracle::uncapped_map(0.1), inference, kClasses,
                                 {.points = 140000, .tiles = 32768, .ray_blocks = 65536});
  for (int i = 0; i < 3; ++i) {
    const tessera::SimulatedScan scan = street->scan(1, i);
    std::vector<std::uint8_t> components;
    for (const std::uint32_t raw : scan.predictions)
      components.push_back(static_cast<std::uint8_t>(1 + raw % kClasses));
    const tessera::Matrix34d T_map_sensor = street->T_map_sensor(1, i).matrix().topRows<3>();
    const tessera::ScanView view{.T_map_sensor = T_map_sensor,
                                 .points = scan.points.data()->data(),
                                 .stride_floats = 4,
                                 .count = scan.points.size(),
                                 .components = components.data()};
    if (mapper.integrator().integrate(mapper.map(), view).admitted == 0) return false;
  }
  std::vector<tessera::KeyedIndex> workspace(2 * mapper.map().block_count());
  tessera::OwnContent own(kComponents);
  int number = 0;
  for (const tessera::KeyedIndex& entry : mapper.map().blocks_in_order(workspace)) {
    if (++number % 4 != 0) continue;
    own->clear();
    add_block(mapper.map(), mapper.map().block_at(entry.index), *own);
    writer.write(*own, tessera::kAllLayers);
  }
  return number > 1000;
}

}  // namespace

int main(int argc, char** argv) {
  std::FILE* const file = argc == 2 ? std::fopen(argv[1], "w") : nullptr;
  if (file == nullptr) return 1;
  Writer writer(file);
  write_made_up(writer);
  const bool ok = write_unlikely(writer) && write_street(writer);
  return std::fclose(file) == 0 && ok ? 0 : 2;
}
