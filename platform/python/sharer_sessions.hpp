// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Maps of earlier days that a tessera.Sharer shares beside its own map.
#pragma once

#include <vector>

#include "held_sharer.hpp"

namespace tessera::python {

/// Those that are not being removed, as dictionaries.
[[nodiscard]] py::list sessions_of(const std::vector<MapSessions::Session>& sessions);
/// Digest, date and weight.
[[nodiscard]] py::dict session_dict(const MapSession& session);
void add_sharer_sessions(py::class_<HeldSharer, std::shared_ptr<HeldSharer>>& sharer_class);

}  // namespace tessera::python
