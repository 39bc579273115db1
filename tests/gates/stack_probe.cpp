// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What the gate of stack use must refuse, one kind an object: PROBE says which. It is compiled and
// never run.
#include <array>
#include <cstddef>

namespace tessera::forbidden {

void use(volatile char* memory);

#if PROBE == 1
void large() {
  std::array<volatile char, 16384> memory;
  use(memory.data());
}
#elif PROBE == 2
int deeper(int n) {
  volatile char memory = 0;
  use(&memory);
  return n > 0 ? deeper(n - 1) + deeper(n / 2) + memory : 0;
}
#elif PROBE == 3
void of_any_size(std::size_t size) {
  auto* const memory = static_cast<volatile char*>(__builtin_alloca(size));
  use(memory);
}
#endif

}  // namespace tessera::forbidden
