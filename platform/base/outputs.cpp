// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "base/outputs.hpp"

#include <algorithm>
#include <filesystem>
#include <system_error>

#include "base/json.hpp"

namespace tessera {

namespace {

namespace fs = std::filesystem;

/// Follows symbolic links as far as the path exists.
fs::path resolved(const fs::path& path) {
  std::error_code error;
  const fs::path absolute = fs::absolute(path, error);
  const fs::path canonical = fs::weakly_canonical(absolute, error);
  return error ? absolute.lexically_normal() : canonical;
}

bool same_file(const fs::path& a, const fs::path& b) {
  std::error_code error;
  // By device and inode: hard links and other spellings are the same file too.
  return resolved(a) == resolved(b) || fs::equivalent(a, b, error);
}

/// True iff path is folder, or somewhere in it.
bool is_within(const fs::path& path, const fs::path& folder) {
  const fs::path outer = resolved(folder);
  for (fs::path inner = resolved(path); inner.has_relative_path(); inner = inner.parent_path()) {
    if (inner == outer) return true;
  }
  return false;
}

/// True iff the folder holds a link to that file.
bool links_to(const fs::path& folder, const fs::path& file) {
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    std::error_code unreadable;
    if (entry->is_symlink(unreadable) && same_file(entry->path(), file)) return true;
  }
  return false;
}

/// True iff the dataset's reader would take path for one of the dataset's files.
bool belongs_to(const DatasetFolder& dataset, const std::string& path) {
  const fs::path root(dataset.path);
  for (const char* const name :
       {"poses.txt", "calib.txt", "times.txt", "classes.toml", "T_global_map.txt"}) {
    if (same_file(root / name, path)) return true;
  }
  std::vector<std::string> folders{"velodyne", "labels", "predictions"};
  folders.insert(folders.end(), dataset.labels.begin(), dataset.labels.end());
  return std::any_of(folders.begin(), folders.end(), [&](const std::string& folder) {
    return is_within(path, root / folder) || links_to(root / folder, path);
  });
}

Failure clash(const NamedFile& output, const Message& what) {
  return {output.option + " " + output.path + " is " + what +
          "; choose another name for the output"};
}

}  // namespace

Outcome<void> check_outputs(const std::vector<NamedFile>& outputs,
                            const std::vector<NamedFile>& inputs, const DatasetFolder& dataset) {
  for (auto output = outputs.begin(); output != outputs.end(); ++output) {
    if (output->path.empty()) continue;
    for (const NamedFile& input : inputs) {
      if (input.path.empty() || !same_file(output->path, input.path)) continue;
      return clash(*output, "the same file as " + input.option + " " + input.path);
    }
    for (auto other = outputs.begin(); other != output; ++other) {
      if (other->path.empty() || !same_file(output->path, other->path)) continue;
      return clash(*output, "the same file as " + other->option);
    }
    if (!dataset.path.empty() && belongs_to(dataset, output->path))
      return clash(*output, "one of the files of the dataset " + dataset.path);
  }
  for (const NamedFile& output : outputs) {
    TESSERA_TRY(check_writable(output.path));
  }
  return {};
}

}  // namespace tessera
