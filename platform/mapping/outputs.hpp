// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// What a subcommand is going to write, checked before it works: every place can be written to, and
// no output replaces an input or another output.
#pragma once

#include <string>
#include <vector>

#include "posix/outcome.hpp"

namespace tessera {

/// A file, and the option that names it.
struct NamedFile {
  const char* option;
  std::string path;  ///< Empty: not given.
};

struct DatasetFolder {
  std::string path{};                 ///< Empty: none.
  std::vector<std::string> labels{};  ///< The label folders that are read, besides the usual ones.
};

/// Fails with kUsage iff an output is one of the inputs or another output, by whatever name; has
/// the place of one of the dataset's files, there or not; or cannot be written to. Leaves nothing
/// behind.
Outcome<void> check_outputs(const std::vector<NamedFile>& outputs,
                            const std::vector<NamedFile>& inputs,
                            const DatasetFolder& dataset = {});

}  // namespace tessera
