// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Counts the heap allocations of the whole process, whoever makes them: our code, the standard
// library, other shared libraries. It replaces malloc and its relatives, so an executable has to
// link the target tessera_allocation_counter itself.
#pragma once

#include <cstdint>
#include <optional>

namespace tessera {

/// Calls of malloc, calloc, realloc and the aligned variants (and so of operator new) since the
/// process started, by all threads. None where it cannot be known: sanitizers have their own heap,
/// and C libraries other than glibc do not let themselves be wrapped this way. A relaxed load.
[[nodiscard]] std::optional<std::uint64_t> heap_allocations() noexcept;

/// Of these, those that the calling thread made.
[[nodiscard]] std::optional<std::uint64_t> thread_heap_allocations() noexcept;

}  // namespace tessera
