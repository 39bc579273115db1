// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// How well two of the maps to fuse lie on each other in their frames: by labels, and by surfaces
// and free space.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "base/json.hpp"
#include "maps/frame_run.hpp"
#include "maps/fuse_setup.hpp"
#include "tessera/fusion/alignment.hpp"

namespace tessera {

/// Two of the maps.
struct PairAlignment {
  std::size_t first = 0;
  std::size_t second = 0;
  /// By labels, where there are common ones.
  std::optional<Alignment> labels{};
  /// By surfaces and free space, searched for near where the frames put the second map, or, where
  /// frames were to be found, anywhere.
  std::optional<FrameAnswer> frame{};
};

/// Tells how far the pairs of maps are.
class PairsProgress {
 public:
  /// Called with hundredths of pairs that are done, and of how many pairs.
  using Done = std::function<void(std::uint64_t hundredths, std::uint64_t pairs)>;
  PairsProgress(Done done, std::size_t maps)
      : done_(std::move(done)), pairs_(std::uint64_t{maps} * (maps - 1) / 2) {}
  /// From here on the pair that is searched goes from one hundredth to another.
  FrameRun::PercentDone part(std::uint32_t from, std::uint32_t to) const {
    return [this, from, to](std::uint32_t percent) { tell(from + (to - from) * percent / 100); };
  }
  void end_pair() {
    ++at_;
    tell(0);
  }

 private:
  void tell(std::uint32_t of_pair) const {
    if (done_) done_(100 * at_ + of_pair, pairs_);
  }

  Done done_;
  std::uint64_t pairs_;
  std::uint64_t at_ = 0;
};

/// Surfaces are compared of up to this number of maps: of more it would take minutes.
inline constexpr std::size_t kMostAligned = 16;

/// Whether it is not one of several submaps.
[[nodiscard]] bool is_whole(const FuseInput& input);
/// T_first_second as the frames have it.
[[nodiscard]] Matrix34d between(const FuseInput& first, const FuseInput& second);
/// By labels; empty: none are common.
[[nodiscard]] std::optional<Alignment> labels_of(const FuseInput& first, const FuseInput& second,
                                                 const Matrix34d& T_first_second);

/// Alignments of all pairs: by labels of up to 20,000 voxels each; and by surfaces, of whole maps,
/// of up to kMostAligned of them. Adds warnings about misaligned pairs.
std::vector<PairAlignment> align_inputs(const std::vector<FuseInput>& inputs,
                                        std::vector<Message>& warnings,
                                        const PairsProgress::Done& done = {});

/// The frames of pairs for a report.
[[nodiscard]] Json frames_json(const std::vector<PairAlignment>& pairs,
                               const std::vector<FuseInput>& inputs);

}  // namespace tessera
