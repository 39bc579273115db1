// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Turns an errno into a sentence for people: what was tried, with which file, what the system said,
// and what to do about it.
#pragma once

#include <string_view>

#include "posix/outcome.hpp"

namespace tessera {

/// "cannot <verb> <path>: <system's words>; <remedy>". error: an errno value.
[[nodiscard]] Failure system_failure(std::string_view verb, std::string_view path, int error,
                                     FailureKind kind);

}  // namespace tessera
