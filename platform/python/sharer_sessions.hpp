// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Maps of earlier days: that a tessera.Sharer shares beside its own map, and that fuse() takes.
#pragma once

#include <pybind11/stl/filesystem.h>

#include <filesystem>
#include <optional>
#include <vector>

#include "arrays.hpp"
#include "held_sharer.hpp"
#include "maps/session_file.hpp"

namespace tessera::python {

/// A session as the arguments of load_session() say.
struct GivenSession {
  std::filesystem::path path;
  double weight = SessionOptions{}.weight;
  std::optional<Matrix34d> T_global_map{};
  std::optional<std::int64_t> date_s{};
};
/// Raises InputError iff the weight is out of its range, or the frame is no transform.
[[nodiscard]] GivenSession given_session(const std::filesystem::path& path, double weight,
                                         const std::optional<PoseArray>& T_global_map,
                                         const std::optional<std::int64_t>& date_s);
/// The file, with the frame and date that are given. Without the GIL. Fails as load_session.
[[nodiscard]] Outcome<SessionFile> load_given(const GivenSession& given);

/// Those that are not being removed, as dictionaries.
[[nodiscard]] py::list sessions_of(const std::vector<MapSessions::Session>& sessions);
/// Digest, date and weight.
[[nodiscard]] py::dict session_dict(const MapSession& session);
void add_sharer_sessions(py::class_<HeldSharer, std::shared_ptr<HeldSharer>>& sharer_class);

}  // namespace tessera::python
