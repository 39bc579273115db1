// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "base/json.hpp"

#include <cstdio>
#include <span>

#include "base/atomic_file.hpp"

namespace tessera {

Outcome<void> write_report(const Json& report, const std::string& path) {
  if (path.empty()) return {};
  TESSERA_TRY_ASSIGN(AtomicFile file, AtomicFile::open(path));
  const std::string text = report.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
  file.write(std::as_bytes(std::span(text)));
  return file.commit();
}

Outcome<void> check_writable(const std::string& path) {
  if (path.empty()) return {};
  TESSERA_TRY(AtomicFile::open(path));
  return {};
}

std::string hex64(std::uint64_t value) {
  std::array<char, 17> text{};
  std::snprintf(text.data(), text.size(), "%016llx", static_cast<unsigned long long>(value));
  return text.data();
}

}  // namespace tessera
