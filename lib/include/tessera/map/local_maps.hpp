// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The local map of a robot; where it maps in submaps, two that take turns. One is mapped into. The
// other is the submap before it, and stays as it was when it ended until all who read it are done:
// so a submap begins from one scan to the next, and nobody waits for what is published or kept.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <optional>

#include "tessera/map/local_map.hpp"

namespace tessera {

/// What was mapped into a submap.
struct SubmapNote {
  std::uint64_t first_scan = 0;  ///< Of those that were integrated, from 0.
  std::uint64_t last_scan = 0;
  double length_m = 0.0;  ///< Way of the robot.
  friend constexpr bool operator==(const SubmapNote&, const SubmapNote&) = default;
};

/// Written to by one thread, that which maps; others read each map through a MapReader, and may
/// call what is said to be for them.
class LocalMaps {
 public:
  /// Who needs a submap that has ended.
  enum class User : std::uint8_t {
    kPublishing,  ///< Until others have been told all of it.
    kKeeping,     ///< Until it is in a file, say.
  };

  /// Bytes of arena that set_up takes.
  [[nodiscard]] static constexpr std::size_t required_bytes(const MapConfig& map,
                                                            bool in_submaps) noexcept {
    return (in_submaps ? 2 : 1) * tessera::required_bytes(map);
  }
  /// first: number of the first submap. Once, before anything else. Fails as LocalMap::make.
  [[nodiscard]] Status set_up(Arena& arena, const MapConfig& config, const ClassTable& classes,
                              bool in_submaps, std::uint32_t first) noexcept;
  /// From the current submap on, none gives way to the one after the next before this user is done
  /// with it. This and the next while no other thread works with this.
  void require(User user) noexcept {
    at_[place_of(user)].store(number(), std::memory_order_relaxed);
    required_[place_of(user)] = true;
  }
  /// The user is gone: nothing waits for it any more.
  void dismiss(User user) noexcept { required_[place_of(user)] = false; }
  [[nodiscard]] bool is_required(User user) const noexcept { return required_[place_of(user)]; }

  // --- For any thread: O(1) ----------------------------------------------------------------------

  [[nodiscard]] bool in_submaps() const noexcept { return in_submaps_; }
  /// Of the submap that is mapped into. What was written to the one before it is to be seen.
  [[nodiscard]] std::uint32_t number() const noexcept {
    return number_.load(std::memory_order_acquire);
  }
  /// The map of a submap: of number(), or of the one before it.
  [[nodiscard]] const LocalMap& of(std::uint32_t number) const noexcept {
    return maps_[in_submaps_ ? number % 2 : 0];
  }
  /// The map that is mapped into. It is another one after each begin(), so ask again for each task.
  [[nodiscard]] const LocalMap& map() const noexcept { return of(number()); }
  /// The submap before, if it lies in the same frame: around the robot there may be something that
  /// only it has. nullptr: there is none.
  [[nodiscard]] const LocalMap* before() const noexcept;
  /// The submap that has ended and that this user is not done with: nothing writes to it.
  [[nodiscard]] std::optional<std::uint32_t> ended(User user) const noexcept;
  /// Of a submap that has ended.
  [[nodiscard]] const SubmapNote& note_of(std::uint32_t ended) const noexcept {
    return notes_[ended % 2];
  }
  /// For the user itself: ended() is done with.
  void note_done(User user) noexcept;

  // --- For the thread that maps ------------------------------------------------------------------

  [[nodiscard]] LocalMap& map() noexcept {
    return maps_[in_submaps_ ? number_.load(std::memory_order_relaxed) % 2 : 0];
  }
  /// All who need the submap before this one are done with it. O(1).
  [[nodiscard]] bool may_begin() const noexcept;
  /// Begins the next submap with an empty map; may_begin() must hold. continues: in the same frame.
  /// ended: of the one before. O(index).
  void begin(bool continues, const SubmapNote& ended) noexcept;

 private:
  static constexpr std::size_t kUsers = 2;
  static constexpr std::size_t place_of(User user) noexcept {
    return static_cast<std::size_t>(user);
  }

  std::array<LocalMap, 2> maps_{};
  std::array<SubmapNote, 2> notes_{};
  bool in_submaps_ = false;
  std::array<bool, kUsers> required_{};
  std::atomic<std::uint32_t> number_{0};
  /// Of the first submap that this one lies in the same frame with.
  std::atomic<std::uint32_t> frame_since_{0};
  /// Of each user: the first submap that it is not done with.
  std::array<std::atomic<std::uint32_t>, kUsers> at_{};
};

}  // namespace tessera
