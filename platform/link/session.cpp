// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "link/session.hpp"

#include <sys/random.h>

#include <cerrno>

namespace tessera {

Outcome<std::uint64_t> make_hash_seed() {
  std::uint64_t random = 0;
  ssize_t bytes = 0;
  do {
    bytes = ::getrandom(&random, sizeof random, 0);
  } while (bytes < 0 && errno == EINTR);
  if (bytes != ssize_t{sizeof random})
    return Failure{"the system gives no random numbers", FailureKind::kFailure};
  return random;
}

Outcome<std::uint64_t> make_session(std::uint32_t starts) {
  const Outcome<std::uint64_t> random = make_hash_seed();
  if (!random.ok()) return random;
  return std::uint64_t{starts} << 32U | static_cast<std::uint32_t>(*random);
}

}  // namespace tessera
