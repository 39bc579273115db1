// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "maps/fuse_sessions.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <optional>

#include "base/number_text.hpp"

namespace tessera {

namespace {

/// What is behind the last colon, if that is a number: a path may have colons.
std::optional<double> weight_in(const std::string& text, std::size_t colon) {
  if (colon == std::string::npos || colon + 1 == text.size()) return std::nullopt;
  double weight = 0.0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data() + colon + 1, end, weight);
  if (error != std::errc() || stop != end) return std::nullopt;
  return weight;
}

/// The file of the frame of this map, taken out of the transforms; empty: none is given.
Outcome<std::string> take_frame(const std::string& path, std::vector<std::string>& transforms) {
  const auto is_of = [&](const std::string& text) {
    return text.size() > path.size() + 1 && text[path.size()] == '=' && text.starts_with(path);
  };
  const auto at = std::find_if(transforms.begin(), transforms.end(), is_of);
  if (at == transforms.end()) return std::string();
  const std::string frame = at->substr(path.size() + 1);
  transforms.erase(at);
  if (std::any_of(transforms.begin(), transforms.end(), is_of))
    return Failure{Message(kTransform) + ": " + path + " already has a transform"};
  return frame;
}

}  // namespace

Outcome<std::vector<SessionOptions>> parse_sessions(const std::vector<std::string>& texts,
                                                    std::vector<std::string>& transforms) {
  TESSERA_TRY(check_number_of_sessions(texts.size()));
  std::vector<SessionOptions> sessions;
  for (const std::string& text : texts) {
    SessionOptions one;
    const std::size_t colon = text.rfind(':');
    const std::optional<double> weight = weight_in(text, colon);
    one.file = weight ? text.substr(0, colon) : text;
    one.weight = weight.value_or(one.weight);
    if (!(one.weight >= kSessionWeights.least && one.weight <= kSessionWeights.most))
      return not_allowed(
          kSessionSetting, text,
          fmt::format("a weight from {} to {} behind the colon", text_of(kSessionWeights.least),
                      text_of(kSessionWeights.most)));
    const auto is_same = [&](const SessionOptions& other) { return other.file == one.file; };
    if (std::any_of(sessions.begin(), sessions.end(), is_same))
      return Failure{Message(kSessionSetting) + " " + one.file + " is given twice"};
    TESSERA_TRY_ASSIGN(one.frame, take_frame(one.file, transforms));
    sessions.push_back(std::move(one));
  }
  return sessions;
}

Outcome<void> check_number_of_sessions(std::size_t sessions) {
  if (sessions <= MapSession::kMostOfRobot) return {};
  return Failure{Message(kSessionSetting) + fmt::format(" is given {} times; give at most {}",
                                                        sessions, MapSession::kMostOfRobot)};
}

Outcome<void> add_session(SessionFile file, std::vector<FuseInput>& inputs,
                          std::vector<Message>& warnings) {
  const ContributionId id = inputs.front().id;
  const MapConfig& like = inputs.front().stored->map.config();
  TESSERA_TRY(check_session(file, like, inputs.front().stored->map.classes()));
  std::uint32_t number = 0;
  for (const FuseInput& other : inputs) {
    if (!other.session) continue;
    ++number;
    if (other.digest == file.session.digest)
      return Failure{file.path + " has the same content as " + other.path + "; give one of them"};
  }
  FuseInput input;
  input.path = file.path;
  input.digest = file.session.digest;
  input.id = {id.robot, id.epoch, MapSession::kFirst + number};
  input.session = file.session;
  input.placed = file.placed;
  input.T_global_map = file.T_global_map;
  input.frame = *GridTransform::make(file.T_global_map, like.resolution_m);
  const bool any_placed =
      std::any_of(inputs.begin(), inputs.end(), [](const FuseInput& one) { return one.placed; });
  if (!input.placed && any_placed)
    warnings.push_back(file.path + " has no T_global_map; its frame is taken for the global one");
  input.stored = std::move(file.stored);
  inputs.push_back(std::move(input));
  return {};
}

Outcome<void> add_sessions(const std::vector<SessionOptions>& sessions,
                           std::vector<FuseInput>& inputs, std::vector<Message>& warnings) {
  for (const SessionOptions& options : sessions) {
    TESSERA_TRY_ASSIGN(SessionFile file, load_session(options));
    TESSERA_TRY(add_session(std::move(file), inputs, warnings));
  }
  return {};
}

}  // namespace tessera
