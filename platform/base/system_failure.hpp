// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Turns an errno into a message: what was tried, with which file, the system's text, and the
// remedy.
#pragma once

#include <string_view>

#include "base/outcome.hpp"

namespace tessera {

/// "cannot <verb> <path>: <system's text>; <remedy>". error: an errno value.
[[nodiscard]] Failure system_failure(std::string_view verb, std::string_view path, int error,
                                     FailureKind kind);

}  // namespace tessera
