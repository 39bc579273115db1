// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// A folder of its own for each test that writes files, gone with everything in it afterwards.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace tessera::test {

class ScratchFolder {
 public:
  ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  ~ScratchFolder();

  [[nodiscard]] std::string file(const std::string& name) const;
  [[nodiscard]] std::size_t file_count() const;

 private:
  std::filesystem::path folder_;
};

[[nodiscard]] std::string read_bytes(const std::string& path);
void write_bytes(const std::string& path, const std::string& bytes);

}  // namespace tessera::test
