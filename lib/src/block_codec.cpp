// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/exchange/block_codec.hpp"

#include "block_model.hpp"
#include "block_probabilities.hpp"
#include "tessera/base/bits.hpp"
#include "tessera/exchange/range_coder.hpp"

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

std::size_t most_bytes_of(unsigned layers) noexcept { return most_coded_bytes(count_ones(layers)); }

/// Octets of these layers, a bit each.
std::uint64_t octets_in(unsigned layers) noexcept {
  std::uint64_t octets = 0;
  for (unsigned layer = 0; layer < kBlockLayers; ++layer) {
    if (((layers >> layer) & 1U) != 0) octets |= std::uint64_t{0xffff} << (16U * layer);
  }
  return octets;
}

void encode(const BlockContent& content, std::uint64_t octets, Coding coding,
            RangeEncoder& range) noexcept {
  range.encode(coding == Coding::kPlain, kPlainIsLikely);
  Decisions<RangeEncoder> decisions(range, coding);
  const bool labels = (content.label_octets() & octets) != 0;
  const bool passes = (content.pass_octets() & octets) != 0;
  BlockModel<Decisions<RangeEncoder>> model(decisions, labels, passes);
  static_cast<void>(model.code_head());
  OctetCode code;
  for (; octets != 0; octets &= octets - 1) {
    const int octet = std::countr_zero(octets);
    read_octet(content, octet, code);
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
  const std::uint64_t octets = octets_in(layers);
  if (((content.label_octets() | content.pass_octets()) & octets) == 0) return 0;
  RangeEncoder likely(into);
  encode(content, octets, Coding::kLikely, likely);
  if (likely.settled() < most_bytes_of(layers)) return likely.finish();
  RangeEncoder plain(into);
  encode(content, octets, Coding::kPlain, plain);
  return plain.finish();
}

Status decode_block(std::span<const std::byte> bytes, unsigned layers, int num_components,
                    BlockContent& content) noexcept {
  if (bytes.empty()) return Status::kOk;
  const std::uint64_t octets = octets_in(layers);
  RangeDecoder range(bytes);
  const Coding coding = range.decode(kPlainIsLikely) ? Coding::kPlain : Coding::kLikely;
  if (!decode(octets, coding, num_components, range, content) || !range.at_end())
    return Status::kCorrupt;
  if (coding == Coding::kLikely)
    return range.settled() < most_bytes_of(layers) ? Status::kOk : Status::kCorrupt;
  // Plain coding is for what would else be too long, and the encoder knows which.
  RangeEncoder likely({});
  encode(content, octets, Coding::kLikely, likely);
  return likely.settled() < most_bytes_of(layers) ? Status::kCorrupt : Status::kOk;
}

}  // namespace tessera
