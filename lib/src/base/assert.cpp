// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "tessera/base/assert.hpp"

#if TESSERA_ASSERTS
// Weak: a program's own definition takes its place.
extern "C" [[gnu::weak, noreturn]] void tessera_assert_failed(const char* /*expression*/,
                                                              const char* /*file*/, int /*line*/) {
  __builtin_trap();
}
#endif
