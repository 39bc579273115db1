// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/internal/block_codec.hpp"

#include "block_model.hpp"
#include "block_probabilities.hpp"
#include "tessera/base/internal/bits.hpp"
#include "tessera/exchange/internal/range_coder.hpp"

namespace tessera {

namespace {

using detail::BlockModel;
using detail::kContexts;
using detail::OctetCode;

/// How decisions are coded: by what is likely, or all the same, so that nothing costs more than it
/// should however unlikely the content is.
enum class Coding : std::uint8_t { kLikely, kPlain };

constexpr std::uint32_t kEven = 2048;
/// How likely plain coding is.
constexpr std::uint32_t kPlainIsLikely = 1;

template <class Range>
class Decisions {
 public:
  Decisions(Range& range, Coding coding) noexcept
      : range_(range), plain_(coding == Coding::kPlain) {
    for (std::size_t i = 0; i < kContexts; ++i)
      probabilities_[i] = Probability(detail::kInitialProbabilities[i]);
  }
  bool bit(unsigned context, bool value) noexcept {
    if (plain_) return even(value);
    Probability& probability = probabilities_[context];
    const bool found = decide(range_, value, probability.one());
    probability.learn(found);
    return found;
  }
  bool even(bool value) noexcept { return decide(range_, value, kEven); }

 private:
  static bool decide(RangeEncoder& range, bool value, std::uint32_t one) noexcept {
    range.encode(value, one);
    return value;
  }
  static bool decide(RangeDecoder& range, bool /*value*/, std::uint32_t one) noexcept {
    return range.decode(one);
  }

  Range& range_;
  bool plain_;
  std::array<Probability, kContexts> probabilities_;
};

/// Where coding by what is likely takes so many bytes, it is given up: what it is meant for takes a
/// tenth of it, and what plain coding then takes at most is promised.
std::size_t too_many_bytes(unsigned layers) noexcept {
  return 3 * most_coded_bytes(count_ones(layers)) / 4;
}

/// Octets of these layers, a bit each.
std::uint64_t octets_in(unsigned layers) noexcept {
  std::uint64_t octets = 0;
  for (unsigned layer = 0; layer < kBlockLayers; ++layer) {
    if (((layers >> layer) & 1U) != 0) octets |= std::uint64_t{0xffff} << (16U * layer);
  }
  return octets;
}

/// A content's octets that are coded, and which of them have something.
struct Octets {
  std::uint64_t coded;
  std::uint64_t labels;
  std::uint64_t passes;

  Octets(const BlockContent& content, unsigned layers) noexcept
      : coded(octets_in(layers)),
        labels(content.label_octets() & coded),
        passes(content.pass_octets() & coded) {}
};

void encode(const BlockContent& content, const Octets& octets, Coding coding,
            RangeEncoder& range) noexcept {
  range.encode(coding == Coding::kPlain, kPlainIsLikely);
  Decisions<RangeEncoder> decisions(range, coding);
  BlockModel<Decisions<RangeEncoder>> model(decisions, octets.labels != 0, octets.passes != 0);
  static_cast<void>(model.code_head());
  OctetCode code;
  for (std::uint64_t rest = octets.coded; rest != 0; rest &= rest - 1) {
    const int octet = std::countr_zero(rest);
    const std::uint64_t bit = rest & (~rest + 1);
    read_octet(content, octet, (octets.labels & bit) != 0, (octets.passes & bit) != 0, code);
    static_cast<void>(model.code_octet(octet, code));
  }
}

/// False iff the decisions contradict each other, are not what encode() would decide, or name
/// components that there are not.
bool decode(std::uint64_t octets, Coding coding, int num_components, RangeDecoder& range,
            BlockContent& content) noexcept {
  Decisions<RangeDecoder> decisions(range, coding);
  BlockModel<Decisions<RangeDecoder>> model(decisions, false, false);
  if (!model.code_head()) return false;
  unsigned labelled = 0;
  unsigned passed = 0;
  for (; octets != 0; octets &= octets - 1) {
    const int octet = std::countr_zero(octets);
    OctetCode code;
    if (!model.code_octet(octet, code)) return false;
    labelled |= code.labelled;
    passed |= code.freed;
    for (const detail::VoxelCode& voxel : code.voxels) {
      passed |= voxel.passes;
      for (const std::uint8_t component : voxel.set.components)
        if (component >= num_components) return false;
    }
    add_octet(code, octet, content);
  }
  return model.labels() == (labelled != 0) && model.passes() == (passed != 0);
}

}  // namespace

std::size_t encode_block(const BlockContent& content, unsigned layers,
                         std::span<std::byte> into) noexcept {
  const Octets octets(content, layers);
  if ((octets.labels | octets.passes) == 0) return 0;
  RangeEncoder likely(into);
  encode(content, octets, Coding::kLikely, likely);
  if (likely.settled() < too_many_bytes(layers)) return likely.finish();
  RangeEncoder plain(into);
  encode(content, octets, Coding::kPlain, plain);
  return plain.finish();
}

Status decode_block(std::span<const std::byte> bytes, unsigned layers, int num_components,
                    BlockContent& content) noexcept {
  if (bytes.empty()) return Status::kOk;
  RangeDecoder range(bytes);
  const Coding coding = range.decode(kPlainIsLikely) ? Coding::kPlain : Coding::kLikely;
  if (!decode(octets_in(layers), coding, num_components, range, content) || !range.at_end())
    return Status::kCorrupt;
  if (coding == Coding::kLikely)
    return range.settled() < too_many_bytes(layers) ? Status::kOk : Status::kCorrupt;
  // Plain coding is for what would else be too long, and the encoder knows which.
  RangeEncoder likely({});
  encode(content, Octets(content, layers), Coding::kLikely, likely);
  return likely.settled() < too_many_bytes(layers) ? Status::kCorrupt : Status::kOk;
}

}  // namespace tessera
