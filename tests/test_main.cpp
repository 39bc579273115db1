// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#define CATCH_CONFIG_MAIN
#include <catch2/catch.hpp>
#include <cstdio>
#include <cstdlib>

#include "tessera/base/assert.hpp"

#if TESSERA_ASSERTS
extern "C" [[noreturn]] void tessera_assert_failed(const char* expression, const char* file,
                                                   int line) {
  std::fprintf(stderr, "%s:%d: assertion failed: %s\n", file, line, expression);
  std::abort();
}
#endif
