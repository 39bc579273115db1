// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// That the header compiles alone; a unit without a declaration of its own would be none in C99.
#include "tessera/tessera.h"

const uint32_t tessera_header_api_version = TESSERA_API_VERSION;
