// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Finds the transform between two maps in memory, and says what was found.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "base/arena_memory.hpp"
#include "base/json.hpp"
#include "base/outcome.hpp"
#include "tessera/frames/search_reach.hpp"
#include "tessera/map/map_file.hpp"

namespace tessera {

class FrameRun {
 public:
  /// Allocates the memory. Fails with kFailure iff the system does not give it.
  static Outcome<std::unique_ptr<FrameRun>> prepare();
  FrameRun(const FrameRun&) = delete;
  FrameRun& operator=(const FrameRun&) = delete;
  FrameRun(FrameRun&&) = delete;
  FrameRun& operator=(FrameRun&&) = delete;
  ~FrameRun() = default;

  /// Called with how much is done (FrameFinder::percent).
  using PercentDone = std::function<void(std::uint32_t percent)>;
  /// Searches, without the heap. A function of the maps' contents and the question. Fails with
  /// kUsage iff the guess is not rigid or the reach is not one.
  Outcome<FrameAnswer> find(const LocalMap& a, const LocalMap& b, const FrameQuestion& question,
                            const PercentDone& done = {});
  [[nodiscard]] const FrameFinder& finder() const noexcept { return finder_; }

 private:
  FrameRun() = default;

  ArenaMemory memory_;
  FrameFinder finder_;
};

/// Without a guess, the frames of the maps are the middle of the search if both have one.
[[nodiscard]] FrameQuestion question_of(const std::optional<Matrix34d>& guess, const MapIdentity& a,
                                        const MapIdentity& b) noexcept;

/// Whether surfaces hold the transform, and the covariance is known.
[[nodiscard]] bool is_held(const FrameAnswer& answer) noexcept;
[[nodiscard]] double degrees_of(double rad) noexcept;
/// "moved by 1.2, 0.3, 0 m, turned by 22.5 degrees".
[[nodiscard]] std::string motion_text(const Matrix34d& T);
/// The angle of a rotation, degrees, 0 .. 180.
[[nodiscard]] double angle_deg(const Matrix34d& T);
/// Counts, and shares of what both have seen.
[[nodiscard]] Json to_json(const Agreement& agreement);
/// Keys transform, covariance, agreement, agreement_before, accepted, reason and what they rest on.
[[nodiscard]] Json to_json(const FrameAnswer& answer);
/// Fails with kFailure, and the reason, iff no frame was found.
Outcome<void> check_found(const FrameAnswer& answer, const std::string& a, const std::string& b);

}  // namespace tessera
