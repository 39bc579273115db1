// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The hook for caller bugs and broken invariants. Compiled out unless TESSERA_ASSERTS is 1. When
// on, a failure traps; a program that defines tessera_assert_failed itself, to log or to reach a
// safe state, gets the call instead. It must not return.
#pragma once

#ifndef TESSERA_ASSERTS
#define TESSERA_ASSERTS 0
#endif

#if TESSERA_ASSERTS
extern "C" [[noreturn]] void tessera_assert_failed(const char* expression, const char* file,
                                                   int line);
#define TESSERA_ASSERT(expression) \
  ((expression) ? static_cast<void>(0) : tessera_assert_failed(#expression, __FILE__, __LINE__))
#else
#define TESSERA_ASSERT(expression) static_cast<void>(sizeof((expression) ? 1 : 0))
#endif
