// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// tessera query: writes the state of a map at given points, CSV to CSV.
#include <fmt/core.h>

#include <charconv>
#include <limits>

#include "base/atomic_file.hpp"
#include "base/input_file.hpp"
#include "base/json.hpp"
#include "base/number_row.hpp"
#include "base/number_text.hpp"
#include "base/outputs.hpp"
#include "cli/command.hpp"
#include "cli/setting_options.hpp"
#include "maps/open_map.hpp"

namespace tessera {

namespace {

struct QueryOptions {
  std::string map;
  std::string points;
  std::string out;
  bool probabilities = false;
  std::string report;
};

constexpr Setting kQueryRows[] = {
    path_row<&QueryOptions::map>({"--map"}, "Map file",
                                 {.value = "MAP.tsm", .required = "a map file"}),
    path_row<&QueryOptions::points>({"--points"}, "CSV with the header x,y,z; metres, map frame",
                                    {.value = "FILE.csv", .required = "a file"}),
    path_row<&QueryOptions::out>({"--out"}, "CSV to write",
                                 {.value = "FILE", .required = "a file"}),
    row<&QueryOptions::probabilities>(
        {"--probabilities"}, "Write the probability of each component too", {.flag = true}),
    path_row<&QueryOptions::report>({"--report"}, "JSON report to write", {.value = "FILE"}),
};
constexpr SettingTable<QueryOptions> kQuerySettings{kQueryRows};

/// Three numbers, which may be "nan" and "inf"; what exceeds a double becomes infinite, so outside
/// the grid.
std::optional<Point3d> parse_point(std::string_view line) {
  Point3d p;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const std::size_t comma = line.find(',');
    if ((comma == std::string_view::npos) != (axis == 2)) return std::nullopt;
    std::string_view field = trimmed(line.substr(0, comma));
    if (field.size() > 1 && field[0] == '+' && field[1] != '-') field.remove_prefix(1);
    double value = 0.0;
    const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
    if (end != field.data() + field.size() || field.empty() || error == std::errc::invalid_argument)
      return std::nullopt;
    const bool huge = error == std::errc::result_out_of_range;
    p[axis] = huge ? std::numeric_limits<double>::infinity() : value;
    line = comma == std::string_view::npos ? std::string_view{} : line.substr(comma + 1);
  }
  return p;
}

void put(AtomicFile& file, std::string_view text) { file.write(std::as_bytes(std::span(text))); }

void put_number(AtomicFile& file, double value) {
  put(file, ",");
  put(file, nine_digits(value));
}

void put_row(AtomicFile& file, const LocalMap& map, bool with_probabilities,
             std::string_view point_text, const Point3d& p_map) {
  const Result<VoxelCoord> voxel = map.lattice().voxel_of(p_map);
  VoxelEvidence evidence;
  evidence.num_components = map.num_components();
  if (voxel.ok()) evidence = map.evidence(*voxel);
  const CountSummary summary = summary_of(evidence);
  const Estimate e = summary.estimate(map.reading());
  put(file, point_text);
  put(file, ",");
  put(file, to_string(e.state));
  put(file, ",");
  put(file, std::to_string(e.label));
  put_number(file, e.probability);
  put_number(file, e.variance);
  put_number(file, e.evidence);
  for (std::size_t l = 0; l < static_cast<std::size_t>(evidence.num_components); ++l) {
    put_number(file, static_cast<double>(evidence.sigma[l]));
  }
  if (with_probabilities) {
    std::array<double, kMaxComponents> all;
    const std::span probabilities =
        std::span(all).first(static_cast<std::size_t>(evidence.num_components));
    summary.distribution(map.reading(), probabilities);
    for (const double probability : probabilities) put_number(file, probability);
  }
  put(file, "\n");
}

/// Content of the file after the header x,y,z.
Outcome<std::string> read_points(const std::string& path) {
  constexpr std::size_t kMaxTextBytes = std::size_t{1} << 32U;
  Outcome<std::string> content = read_text_file(path, kMaxTextBytes);
  if (!content.ok()) return content.failure();
  if (content->empty()) return Failure{path + " is empty; its line 1 must be x,y,z"};
  std::string_view text = *content;
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";  // Spreadsheets write it.
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  if (text.empty() || trimmed(take_line(text)) != "x,y,z") {
    return text_failure({path, 1}, "the header is missing", "it must be x,y,z");
  }
  content->erase(0, content->size() - text.size());
  return content;
}

void put_header(AtomicFile& out, const LocalMap& map, bool with_probabilities) {
  std::string header = "x,y,z,state,label,probability,variance,evidence";
  for (int l = 0; l < map.num_components(); ++l) header += fmt::format(",sigma_{}", l);
  for (int l = 0; with_probabilities && l < map.num_components(); ++l)
    header += fmt::format(",probability_{}", l);
  put(out, header + "\n");
}

/// points: the lines from number 2. Returns the number of rows written.
Outcome<std::uint64_t> put_rows(AtomicFile& out, const LocalMap& map, const QueryOptions& options,
                                std::string_view points) {
  std::uint64_t rows = 0;
  for (TextPlace place{options.points, 2}; !points.empty(); ++place.line) {
    const std::string_view text = trimmed(take_line(points));
    if (text.empty()) continue;
    const std::optional<Point3d> p_map = parse_point(text);
    if (!p_map) return text_failure(place, "not three numbers x,y,z", "fix or remove it");
    put_row(out, map, options.probabilities, text, *p_map);
    ++rows;
  }
  return rows;
}

Outcome<void> run_query(const QueryOptions& options) {
  TESSERA_TRY(check_outputs({{"--out", options.out}, {"--report", options.report}},
                            {{"--map", options.map}, {"--points", options.points}}));
  TESSERA_TRY_ASSIGN(const std::unique_ptr<StoredMap> stored, open_map(options.map));
  const LocalMap& map = stored->map;
  TESSERA_TRY_ASSIGN(const std::string points, read_points(options.points));
  TESSERA_TRY_ASSIGN(AtomicFile out, AtomicFile::open(options.out));
  put_header(out, map, options.probabilities);
  TESSERA_TRY_ASSIGN(const std::uint64_t rows, put_rows(out, map, options, points));
  TESSERA_TRY(out.commit());
  std::printf("%s into %s\n", counted(rows, "point").c_str(), options.out.c_str());
  return write_report({{"points", rows},
                       {"config",
                        {{"map", options.map},
                         {"points", options.points},
                         {"out", options.out},
                         {"probabilities", options.probabilities},
                         {"report", options.report}}}},
                      options.report);
}

}  // namespace

void add_query_command(CLI::App& app, int& exit_status) {
  CLI::App* const command = app.add_subcommand("query", "Write the state of a map at given points");
  auto o = std::make_shared<QueryOptions>();
  declare_settings(*command, kQuerySettings, *o);
  command->footer("Example: tessera query --map map.tsm --points points.csv --out states.csv");
  command->callback([o, &exit_status] {
    const Outcome<void> outcome = run_query(*o);
    if (!outcome.ok()) exit_status = fail(outcome.failure());
  });
}

}  // namespace tessera
