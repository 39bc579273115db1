// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/internal/block_codec.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "fuzz/block_content_memory.hpp"
#include "tessera/exchange/internal/evidence_levels.hpp"
#include "tessera/map/internal/packed_block.hpp"

namespace tessera::fuzz {

namespace {

void check_ranges(const BlockContent& content, unsigned layers, int num_components) {
  require((content.components() >> (num_components - 1) >> 1U) == 0, "a component that is not");
  for (int row = 0; row < kBlockVoxels; ++row) {
    bool any = content.rest(row) > 0.0F || content.passes(row) != 0;
    int kept = 0;
    for (int c = 1; c < num_components; ++c) {
      const float count = content.count(c, row);
      require(std::isfinite(count) && count >= 0.0F && count <= count_of_level(kMostLevel),
              "a count out of range");
      kept += count > 0.0F ? 1 : 0;
      any = any || count > 0.0F;
    }
    require(content.rest(row) >= 0.0F && content.rest(row) <= count_of_level(kMostLevel),
            "a rest out of range");
    require(content.passes(row) <= passes_of_level(kMostPassesLevel), "passes out of range");
    require(kept <= 3, "more than three components");
    require(!any || ((layers >> layer_of_row(row)) & 1U) != 0, "a voxel of another layer");
  }
}

void check_same(Bytes a, Bytes b, const char* what) {
  require(a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin(), b.end()), what);
}

}  // namespace

void draw_content(Input& input, int num_components, BlockContent& content) {
  while (!input.empty()) {
    const int what = input.u8();
    const int row = input.u16() % kBlockVoxels;
    // A run of voxels costs the input no more than one.
    const int run = 1 + (what & 15);
    for (int r = row; r < std::min(row + run, kBlockVoxels); ++r) {
      if ((what & 0x30) == 0) {
        content.add_passes(r, 1U + input.u8());
      } else {
        // 2^-16 .. 2^23: beyond both ends of what is coded.
        const unsigned of_count = input.u8();
        const float count = std::ldexp(1.0F + static_cast<float>(of_count & 7U) / 8.0F,
                                       static_cast<int>(of_count >> 3U) - 12);
        const int component = what >> 6U == 3 ? 0 : 1 + input.below(num_components - 1);
        component == 0 ? content.add_rest(r, count) : content.add(component, r, count);
      }
    }
  }
}

void block_codec(Bytes bytes) {
  static OwnContent decoded;
  static OwnContent again;
  static std::array<std::byte, most_coded_bytes(kBlockLayers)> code;
  static std::array<std::byte, most_coded_bytes(kBlockLayers)> second;
  static std::array<std::byte, most_packed_bytes(kMaxComponents)> packed;
  Input input(bytes);
  const unsigned how = input.u8();
  const int num_components = 3 + input.below(kMaxComponents - 2);
  const unsigned layers = 1U + (how & 15U) % kAllLayers;
  BlockContent& content = decoded.cleared();
  std::size_t size = input.rest().size();
  const bool drawn = (how & 0x10U) != 0;
  if (!drawn) {
    const Status status = decode_block(input.rest(), layers, num_components, content);
    require(status == Status::kOk || status == Status::kCorrupt, "another status");
    if (status != Status::kOk) return;
    require(encode_block(content, layers, code) == size, "a code of another length");
    check_same(std::span(code).first(size), input.rest(), "a code that is not canonical");
  } else {
    draw_content(input, num_components, content);
    quantise(content);
    size = encode_block(content, layers, code);
    BlockContent& other = again.cleared();
    require(decode_block(std::span(code).first(size), layers, num_components, other) == Status::kOk,
            "what was coded is not decoded");
    require(encode_block(other, layers, second) == size, "another length the second time");
    check_same(std::span(second).first(size), std::span(code).first(size), "another code");
    require(decode_block(std::span(code).first(size), layers, num_components, decoded.cleared()) ==
                Status::kOk,
            "not decoded a second time");
  }
  const Bytes coded = std::span(code).first(size);
  require(size <= most_coded_bytes(count_ones(layers)), "a code that is too long");
  check_ranges(content, layers, num_components);
  const std::size_t packed_bytes = pack_block(content, packed);
  require(check_packed(std::span(packed).first(packed_bytes), num_components) == Status::kOk ||
              packed_bytes == 0,
          "what is packed is refused");
  // Others may send what quantising would not leave; it is a fixed point after one time.
  quantise(content);
  const std::size_t quantised = encode_block(content, layers, second);
  if (drawn) check_same(std::span(second).first(quantised), coded, "quantising again changes it");
  quantise(content);
  require(encode_block(content, layers, code) == quantised, "quantised otherwise");
  check_same(std::span(second).first(quantised), std::span(code).first(quantised),
             "quantised otherwise");
}

void packed_block(Bytes bytes) {
  static OwnContent unpacked;
  static std::array<std::byte, most_packed_bytes(kMaxComponents)> packed;
  Input input(bytes);
  const unsigned how = input.u8();
  const int num_components = 3 + input.below(kMaxComponents - 2);
  BlockContent& content = unpacked.cleared();
  Bytes code = input.rest();
  if ((how & 1U) != 0) {
    draw_content(input, num_components, content);
    code = std::span(packed).first(pack_block(content, packed));
    require(code.empty() || check_packed(code, num_components) == Status::kOk, "refused");
    if (code.empty()) return;
  } else if (check_packed(code, num_components) != Status::kOk) {
    return;
  }
  require(code.size() <= most_packed_bytes(num_components), "too long");
  BlockContent& again = unpacked.cleared();
  bool in_range = true;  // Nothing may be thrown from within.
  unpack_block(
      code,
      [&](int row, int component, float count) {
        in_range = in_range && row >= 0 && row < kBlockVoxels && component < num_components;
        if (!in_range) return;
        component == 0 ? again.add_rest(row, count) : again.add(component, row, count);
      },
      [&](int row, unsigned passes) {
        in_range = in_range && row >= 0 && row < kBlockVoxels && passes <= 255;
        if (in_range) again.add_passes(row, passes);
      });
  require(in_range, "a voxel, component or passes out of range");
  static std::array<std::byte, most_packed_bytes(kMaxComponents)> second;
  check_same(std::span(second).first(pack_block(again, second)), code, "packed otherwise");
}

}  // namespace tessera::fuzz
