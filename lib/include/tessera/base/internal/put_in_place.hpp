// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>

#include "tessera/base/status.hpp"

namespace tessera {

/// Calls make() for a part and moves it to its place. On its own, so that what parts take of the
/// stack until they are in their place does not add up.
template <class Part, class Make>
[[gnu::noinline]] Status put_in_place(Part& into, Make&& make) noexcept {
  Result<Part> made = make();
  if (made.ok()) into = std::move(*made);
  return made.status();
}

}  // namespace tessera
