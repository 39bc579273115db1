// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Memory that is present before it is needed and stays present: real-time threads cause no page
// faults.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace tessera {

/// Locks all current and future memory of the process, so that nothing is paged out. Empty iff it
/// succeeds; else nothing is locked, and the text has the reason and the remedy. Once locked, the
/// process gets no more than the limit of locked memory: call it after memory is allocated.
/// room_bytes: later allocations; if they do not fit into the limit, nothing is locked.
[[nodiscard]] std::string lock_memory(std::size_t room_bytes = 0);
/// Makes every page of memory present now. The content is unchanged. O(pages).
void prefault(std::span<std::byte> memory) noexcept;
/// The same for the part of the calling thread's stack that its calls will use.
void prefault_stack() noexcept;
/// The process keeps freed memory, so that later allocations need no new pages as long as they are
/// not more than before. All threads that start later share one heap.
void keep_freed_memory() noexcept;

/// Page faults: from memory, and from a disk.
struct PageFaults {
  std::uint64_t minor = 0;
  std::uint64_t major = 0;
};
/// Of the calling thread since its start. A system call.
[[nodiscard]] PageFaults thread_page_faults() noexcept;
/// Bytes of memory that the process uses now; 0 if the system does not report it. Some system
/// calls, no heap.
[[nodiscard]] std::size_t resident_bytes() noexcept;

}  // namespace tessera
