// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Counts all heap allocations of the process: of this code, the standard library, and other shared
// libraries. It replaces malloc and its relatives, so an executable must link the target
// tessera_allocation_counter itself.
#pragma once

#include <cstdint>
#include <optional>

namespace tessera {

/// Calls of malloc, calloc, realloc and the aligned variants (and so of operator new) since the
/// process started, by all threads. Empty if it is not known: sanitizers have their own heap, and C
/// libraries other than glibc cannot be wrapped this way. A relaxed load.
[[nodiscard]] std::optional<std::uint64_t> heap_allocations() noexcept;

/// Those of the calling thread.
[[nodiscard]] std::optional<std::uint64_t> thread_heap_allocations() noexcept;

}  // namespace tessera
