// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// Checks the outputs of a subcommand before its work: every path can be written to, and no output
// replaces an input or another output.
#pragma once

#include <string>
#include <vector>

#include "base/outcome.hpp"

namespace tessera {

/// A file, and the option that names it.
struct NamedFile {
  Message option;
  std::string path;  ///< Empty: not given.
};

struct DatasetFolder {
  std::string path{};  ///< Empty: none.
  std::vector<std::string>
      labels{};  ///< The label folders that are read, apart from the usual ones.
};

/// Fails with kUsage iff an output is one of the inputs or another output, by any name; has the
/// path of one of the dataset's files, existing or not; or cannot be written to. Leaves no files.
Outcome<void> check_outputs(const std::vector<NamedFile>& outputs,
                            const std::vector<NamedFile>& inputs,
                            const DatasetFolder& dataset = {});

}  // namespace tessera
