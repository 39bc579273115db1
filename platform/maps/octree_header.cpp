// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "maps/octree_header.hpp"

#include <algorithm>
#include <charconv>
#include <optional>

#include "base/number_row.hpp"

namespace tessera {
namespace {

constexpr std::size_t kMostHeaderBytes = 4096;
constexpr std::string_view kFullLine = "# Octomap OcTree file";
constexpr std::string_view kBinaryLine = "# Octomap OcTree binary file";

/// Quotes text of a file, which may be of any kind, for a message.
std::string quoted(std::string_view text) {
  std::string shown(text.substr(0, 32));
  for (char& letter : shown)
    if (letter < ' ' || letter > '~') letter = '?';
  return "'" + shown + "'";
}

class HeaderReader {
 public:
  explicit HeaderReader(const OctreeBytes& file)
      : path_(file.path), text_(file.bytes.substr(0, kMostHeaderBytes)), all_(text_.size()) {}

  Outcome<OctreeHeader> read() {
    const std::string_view first = text_.empty() ? text_ : take_line(text_);
    header_.is_binary = first == kBinaryLine;
    if (!header_.is_binary && first != kFullLine) {
      return octree_failure(path_, "it does not begin as OctoMap's files do",
                            "give a .bt or .ot file");
    }
    while (!text_.empty()) {
      std::string_view line = take_line(text_);
      const std::string_view key = take_word(line);
      if (key.empty() || key.front() == '#') continue;
      if (key == "data") return finish();
      if (!take(key, trimmed(line))) return *failure_;
    }
    return octree_failure(path_, "its first 4096 bytes have no line 'data'", "get a complete copy");
  }

 private:
  bool refuse(std::string_view what, std::string_view remedy) {
    failure_ = octree_failure(path_, what, std::string(remedy));
    return false;
  }
  bool take(std::string_view key, std::string_view value) {
    if (key == "id") return take_id(value);
    if (key == "size") return take_size(value);
    if (key == "res") return take_resolution(value);
    return refuse("its header has an unknown line " + quoted(key),
                  "a header has id, size, res and data, and comments");
  }
  bool once(bool& has) {
    if (has) return refuse("its header has a duplicate line", "get another copy");
    has = true;
    return true;
  }
  bool take_id(std::string_view id) {
    if (id == "OcTree") header_.node_bytes = 4;
    if (id == "ColorOcTree") header_.node_bytes = 7;
    if (header_.node_bytes != 0) return once(has_id_);
    return refuse("unsupported tree " + quoted(id),
                  "write it as an OcTree or a ColorOcTree, with OctoMap's convert_octree");
  }
  bool take_size(std::string_view word) {
    const auto [end, error] =
        std::from_chars(word.data(), word.data() + word.size(), header_.nodes);
    if (error == std::errc{} && end == word.data() + word.size()) return once(has_size_);
    return refuse("size " + quoted(word) + " is not a number of nodes", "get another copy");
  }
  bool take_resolution(std::string_view word) {
    if (parse_double(word, header_.resolution_m) && header_.resolution_m >= 1e-6 &&
        header_.resolution_m <= 1e6)
      return once(has_resolution_);
    return refuse("res " + quoted(word) + " is not a resolution", "write metres from 1e-6 to 1e6");
  }
  Outcome<OctreeHeader> finish() {
    if (!has_id_ || !has_size_ || !has_resolution_) {
      return octree_failure(path_, "its header has no line id, size or res",
                            "it must have all three; get another copy");
    }
    header_.header_bytes = all_ - text_.size();
    return header_;
  }

  std::string_view path_;
  std::string_view text_;  ///< The unread rest.
  std::size_t all_;
  OctreeHeader header_;
  bool has_id_ = false;
  bool has_size_ = false;
  bool has_resolution_ = false;
  std::optional<Failure> failure_;
};

}  // namespace

Failure octree_failure(std::string_view path, std::string_view what, const Message& remedy) {
  return Failure{one_line(std::string(path) + ": " + std::string(what) + "; ") + remedy};
}

Outcome<OctreeHeader> parse_octree_header(const OctreeBytes& file) {
  return HeaderReader(file).read();
}

}  // namespace tessera
