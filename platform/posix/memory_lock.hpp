// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Memory that is there before it is needed and stays there: no page of it is fetched by a thread
// that has no time for that.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace tessera {

/// Locks all memory that the process has and will get, so that nothing of it is paged out. Empty
/// iff it did; else nothing is locked, and it says why not and what to do. Once it is locked, no
/// more is given than the limit of locked memory: so call it when memory is taken. room_bytes: what
/// will be taken later; where the limit has no room for that, nothing is locked.
[[nodiscard]] std::string lock_memory(std::size_t room_bytes = 0);
/// Gives every page of memory its place now. Content stays as it is. O(pages).
void prefault(std::span<std::byte> memory) noexcept;
/// The same for the part of the calling thread's stack that its calls will use.
void prefault_stack() noexcept;
/// Memory that is freed stays the process's own, so that what is allocated later needs no new
/// pages as long as it is not more than before. All threads that begin later share one heap.
void keep_freed_memory() noexcept;

/// Pages that were fetched for whoever asks: from memory, and from a disk.
struct PageFaults {
  std::uint64_t minor = 0;
  std::uint64_t major = 0;
};
/// Of the calling thread since it began. A system call.
[[nodiscard]] PageFaults thread_page_faults() noexcept;
/// Bytes of memory that the process has in use now; 0 where the system does not say. Some system
/// calls, no heap.
[[nodiscard]] std::size_t resident_bytes() noexcept;

}  // namespace tessera
