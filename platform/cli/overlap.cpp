// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/overlap.hpp"

#include <algorithm>
#include <set>
#include <utility>

#include "cli/command.hpp"
#include "maps/open_map.hpp"
#include "tessera/base/rigid.hpp"
#include "tessera/registration/scan.hpp"

namespace tessera {

namespace {

/// True iff both maps are in the frame of one start of one robot.
bool same_frame(const MapIdentity& a, const MapIdentity& b) {
  return a.kind == MapKind::kLocal && b.kind == MapKind::kLocal && a.robot == b.robot &&
         a.epoch == b.epoch;
}

Matrix34d between(const MapIdentity& to, const MapIdentity& from) {
  // Going through the global frame would round.
  if (same_frame(to, from)) return Matrix34d::Identity();
  return product(inverse(to.place()), from.place());
}

/// Paths of the maps whose frames are not related by a common robot.
using Placeless = std::set<std::string>;

void note_unknown_places(const MapIdentity& a, const std::string& path_a, const MapIdentity& b,
                         const std::string& path_b, Placeless& placeless) {
  if (same_frame(a, b)) return;
  if (!a.is_placed()) placeless.insert(path_a);
  if (!b.is_placed()) placeless.insert(path_b);
}

}  // namespace

Outcome<std::vector<OverlapMap>> load_overlap(const std::vector<std::string>& paths,
                                              const StoredMap& evaluated,
                                              const std::string& evaluated_path) {
  std::vector<OverlapMap> maps;
  Placeless placeless;
  for (const std::string& path : paths) {
    TESSERA_TRY_ASSIGN(std::unique_ptr<StoredMap> stored, open_map(path));
    if (!(stored->map.classes() == evaluated.map.classes())) {
      return Failure{"--overlap-of " + path + " has other classes than " + evaluated_path +
                     "; give maps that were made with the same classes"};
    }
    const MapIdentity& own = stored->header.identity;
    const MapIdentity& other = evaluated.header.identity;
    note_unknown_places(own, path, other, evaluated_path, placeless);
    maps.push_back({std::move(stored), between(own, other)});
  }
  for (const std::string& path : placeless)
    warn(path + " has no T_global_map; its frame is taken for the global one");
  return maps;
}

bool in_overlap(const std::vector<OverlapMap>& maps, const Point3f& p_map) {
  return std::all_of(maps.begin(), maps.end(), [&](const OverlapMap& other) {
    return other.stored->map.query(transform(other.T_own_map, p_map.data())).label != 0;
  });
}

}  // namespace tessera
