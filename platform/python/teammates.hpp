// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Other robots that say where they are, as Python has them.
#pragma once

#include <optional>
#include <vector>

#include "held_sharer.hpp"

namespace tessera::python {

/// Boxes of what Sharer.teammates() gave, or of dicts with the same T_map_body, low, high and
/// margin_m. Raises InputError iff one is none of a robot, as TeammateFilter asks for it.
[[nodiscard]] std::vector<PlacedBox> boxes_of(const std::optional<py::list>& teammates);

void add_sharer_teammates(py::class_<HeldSharer, std::shared_ptr<HeldSharer>>& sharer);

}  // namespace tessera::python
