// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Whether the monotonic clock is still that of before.
#pragma once

#include <cstdint>

namespace tessera {

/// Another number after each start of the machine; 0 if the system does not say.
std::uint64_t boot_id();

}  // namespace tessera
