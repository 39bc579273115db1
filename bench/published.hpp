// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A publication that goes nowhere: keeps what was published, and estimates what it takes on the
// wire.
#pragma once

#include <bit>
#include <ctime>
#include <unordered_map>
#include <vector>

#include "tessera/exchange/publisher.hpp"
#include "tessera/map/packed_block.hpp"

namespace tessera::bench {

/// Of the calling thread.
[[nodiscard]] inline double cpu_ms() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

/// Keeps what was published, and estimates what it takes on the wire.
class Published {
 public:
  Published(int num_components, double bytes_label_voxel)
      : packed_(most_packed_bytes(num_components)), bytes_label_voxel_(bytes_label_voxel) {}

  Publication interface() {
    return {this,
            [](void* self, BlockContent& content) {
              static_cast<Published*>(self)->timed([&] { quantise(content); });
            },
            [](void* self, BlockKey key, BlockContent& content) {
              bool found = false;
              auto* const published = static_cast<Published*>(self);
              published->timed([&] { found = published->read(key, content); });
              return found;
            },
            [](void* self, BlockKey key, const BlockContent& content) {
              WireBytes bytes;
              auto* const published = static_cast<Published*>(self);
              published->timed([&] { bytes = published->publish(key, content); });
              return Result<WireBytes>(bytes);
            }};
  }
  /// CPU time in the functions of the interface.
  [[nodiscard]] double cpu_spent_ms() const { return spent_ms_; }
  bool read(BlockKey key, BlockContent& content) const {
    const auto found = blocks_.find(key.bits);
    if (found == blocks_.end()) return false;
    unpack_block(
        found->second,
        [&](int row, int component, float count) {
          component == 0 ? content.add_rest(row, count) : content.add(component, row, count);
        },
        [&](int row, unsigned passes) { content.add_passes(row, passes); });
    return true;
  }
  [[nodiscard]] const std::unordered_map<std::uint64_t, int>& times_sent() const { return sent_; }

 private:
  /// Counts to four binary digits, passes of voxels that are only free to one.
  static void quantise(BlockContent& content) {
    for (int row = 0; row < kBlockVoxels; ++row) {
      bool labelled = content.rest(row) > 0.0F;
      for (std::uint64_t rest = content.components(); rest != 0; rest &= rest - 1) {
        const int component = std::countr_zero(rest);
        const float count = content.count(component, row);
        if (!(count > 0.0F)) continue;
        labelled = true;
        const std::uint32_t bits = std::bit_cast<std::uint32_t>(count) + (1U << 19U);
        content.set(component, row, std::bit_cast<float>(bits & ~((1U << 20U) - 1U)));
      }
      if (!labelled && content.passes(row) != 0) content.set_passes(row, 1);
    }
  }
  WireBytes publish(BlockKey key, const BlockContent& content) {
    const std::size_t size = pack_block(content, packed_);
    int labels = 0;
    int free = 0;
    for (int row = 0; row < kBlockVoxels; ++row) {
      bool labelled = content.rest(row) > 0.0F;
      for (std::uint64_t rest = content.components(); rest != 0; rest &= rest - 1)
        labelled = labelled || content.count(std::countr_zero(rest), row) > 0.0F;
      labels += labelled ? 1 : 0;
      free += !labelled && content.passes(row) != 0 ? 1 : 0;
    }
    blocks_[key.bits].assign(packed_.begin(), packed_.begin() + static_cast<std::ptrdiff_t>(size));
    if (labels > 0) ++sent_[key.bits];
    const double of_labels = labels > 0 ? 12.0 + bytes_label_voxel_ * labels : 0.0;
    const double of_free = (labels > 0 ? 0.0 : 12.0) + 0.1 * free;
    return {static_cast<std::uint32_t>(of_labels), static_cast<std::uint32_t>(of_free)};
  }

  template <class Work>
  void timed(Work&& work) {
    const double start_ms = cpu_ms();
    work();
    spent_ms_ += cpu_ms() - start_ms;
  }

  std::vector<std::byte> packed_;
  double spent_ms_ = 0.0;
  double bytes_label_voxel_;
  std::unordered_map<std::uint64_t, std::vector<std::byte>> blocks_;
  std::unordered_map<std::uint64_t, int> sent_;
};

}  // namespace tessera::bench
