// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Where it was before other robots had bodies too.
#pragma once

#include "tessera/base/robot_body.hpp"  // IWYU pragma: export
