// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "settings/source_options.hpp"

namespace tessera {

Json to_json(const SourceOptions& o) {
  Json json = json_of(kSourceSettings, o);
  json["labels"] = o.labels_or_default();
  return json;
}

}  // namespace tessera
