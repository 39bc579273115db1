// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What does a map take over the air, and what does it lose? Bytes of coded blocks for each label
// voxel and each free-only one, voxels whose state or label rounding changes, and time.
#include <algorithm>
#include <cstdio>

#include "codec_blocks.hpp"
#include "tessera/exchange/internal/block_codec.hpp"

namespace tessera::bench {

namespace {

struct Counts {
  std::uint64_t blocks = 0;
  std::uint64_t label_voxels = 0;
  std::uint64_t free_voxels = 0;
  std::uint64_t bytes = 0;
  std::uint64_t label_bytes = 0;    ///< Of codes without passes.
  std::uint64_t label_changes = 0;  ///< Voxels with another label.
  std::uint64_t state_changes = 0;  ///< Voxels that are free instead of occupied, or the reverse.
  std::uint64_t largest_bytes = 0;
};

using Row = std::pair<Estimate, bool>;  ///< Whether there is label evidence.

/// What the map says of a content's voxels.
std::vector<Row> rows_of(const BlockContent& content, const LocalMap& map) {
  std::vector<Row> rows;
  for (int row = 0; row < kBlockVoxels; ++row) {
    const float free = static_cast<float>(content.passes(row)) * map.config().free_weight;
    CountSummary summary(map.num_components(), free);
    for (std::uint64_t rest = content.components(); rest != 0; rest &= rest - 1)
      summary.add(std::countr_zero(rest), content.count(std::countr_zero(rest), row));
    summary.add_rest(content.rest(row));
    const Estimate estimate = summary.estimate(map.config().prior);
    rows.emplace_back(estimate, estimate.evidence > static_cast<double>(free));
  }
  return rows;
}

void compare(const std::vector<Row>& before, const std::vector<Row>& after, Counts& counts) {
  for (std::size_t i = 0; i < before.size(); ++i) {
    const Estimate& was = before[i].first;
    const Estimate& is = after[i].first;
    if (was.state == VoxelState::kUnknown) continue;
    before[i].second ? ++counts.label_voxels : ++counts.free_voxels;
    counts.label_changes += was.label != is.label ? 1U : 0U;
    counts.state_changes += was.state != is.state ? 1U : 0U;
  }
}

/// Counts a content, and appends its code.
class Counting {
 public:
  explicit Counting(const LocalMap& map) : map_(map), labels_(map.num_components()) {}

  void add(BlockContent& content) {
    const std::vector<Row> before = rows_of(content, map_);
    quantise(content);
    compare(before, rows_of(content, map_), counts);
    const std::size_t size = encode_block(content, kAllLayers, bytes_);
    codes.emplace_back(bytes_.begin(), bytes_.begin() + static_cast<std::ptrdiff_t>(size));
    for (const std::byte byte : codes.back()) digest.add(std::to_integer<std::uint64_t>(byte));
    labels_->clear();
    for (int row = 0; row < kBlockVoxels; ++row) {
      for (std::uint64_t rest = content.components(); rest != 0; rest &= rest - 1) {
        const int component = std::countr_zero(rest);
        if (content.count(component, row) > 0.0F)
          labels_->set(component, row, content.count(component, row));
      }
      if (content.rest(row) > 0.0F) labels_->add_rest(row, content.rest(row));
    }
    ++counts.blocks;
    counts.bytes += size;
    counts.largest_bytes = std::max<std::uint64_t>(counts.largest_bytes, size);
    counts.label_bytes += encode_block(*labels_, kAllLayers, bytes_);
  }

  Counts counts;
  std::vector<std::vector<std::byte>> codes;
  Digest digest;

 private:
  const LocalMap& map_;
  OwnContent labels_;  ///< Of a block, without its passes.
  std::vector<std::byte> bytes_ = std::vector<std::byte>(most_coded_bytes(kBlockLayers));
};

/// Microseconds that all codes take, a block: decoding, and encoding again. In groups, as the clock
/// has steps of a microsecond.
std::pair<double, double> time_of(const std::vector<std::vector<std::byte>>& codes,
                                  int components) {
  constexpr std::size_t kGroup = 64;
  std::vector<OwnContent> group;
  for (std::size_t i = 0; i < kGroup; ++i) group.emplace_back(components);
  std::vector<std::byte> bytes(most_coded_bytes(kBlockLayers));
  double decoding = 0.0;
  double encoding = 0.0;
  for (std::size_t k = 0; k < codes.size(); k += kGroup) {
    const std::size_t n = std::min(kGroup, codes.size() - k);
    for (std::size_t i = 0; i < n; ++i) group[i]->clear();
    decoding += seconds_of([&] {
      for (std::size_t i = 0; i < n; ++i)
        static_cast<void>(decode_block(codes[k + i], kAllLayers, components, *group[i]));
    });
    encoding += seconds_of([&] {
      for (std::size_t i = 0; i < n; ++i)
        static_cast<void>(encode_block(*group[i], kAllLayers, bytes));
    });
  }
  const double per_block = 1e6 / static_cast<double>(codes.size());
  return {decoding * per_block, encoding * per_block};
}

Outcome<Json> measure(const Options& options, Records& records) {
  TESSERA_TRY_ASSIGN(Mapper mapper, map_as_command(options));
  Counting counting(mapper.map());
  for_each_content(mapper, [&](BlockContent& content) { counting.add(content); });
  const Counts& counts = counting.counts;
  records.check("chunk_bytes", counting.digest.value());
  std::vector<double> decode_us;
  std::vector<double> encode_us;
  for (int i = 0; i < options.repetitions; ++i) {
    const auto [decoding, encoding] = time_of(counting.codes, mapper.map().num_components());
    decode_us.push_back(decoding);
    encode_us.push_back(encoding);
  }
  const auto part = [](std::uint64_t some, std::uint64_t all) {
    return all == 0 ? 0.0 : static_cast<double>(some) / static_cast<double>(all);
  };
  Json json{{"blocks", counts.blocks},
            {"label_voxels", counts.label_voxels},
            {"free_voxels", counts.free_voxels},
            {"bytes", counts.bytes},
            {"largest_bytes", counts.largest_bytes},
            {"bytes_per_label_voxel", part(counts.label_bytes, counts.label_voxels)},
            {"bytes_per_free_voxel", part(counts.bytes - counts.label_bytes, counts.free_voxels)},
            {"label_changes", counts.label_changes},
            {"state_changes", counts.state_changes},
            {"encode_us", median(encode_us)},
            {"decode_us", median(decode_us)}};
  for (const auto& [name, value] : json.items())
    std::printf("%-22s %s\n", name.c_str(), value.dump().c_str());
  return json;
}

}  // namespace

}  // namespace tessera::bench

int main(int argc, char** argv) {
  return tessera::bench::run(argc, argv, "chunk_bytes", tessera::bench::measure);
}
