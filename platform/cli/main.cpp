// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// The command: tessera SUBCOMMAND [options].
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>

#include "cli/command.hpp"
#include "settings/map_options.hpp"
#include "tessera/base/assert.hpp"
#include "tessera/base/version.hpp"

namespace tessera {

int fail(const Failure& failure) {
  std::string message = failure.text();  // One line, even if a name in it has several.
  std::replace(message.begin(), message.end(), '\n', ' ');
  std::fprintf(stderr, "tessera: %s\n", message.c_str());
  return failure.kind == FailureKind::kUsage ? kExitUsage : kExitFailure;
}

void warn(const Message& message) { std::fprintf(stderr, "warning: %s\n", message.text().c_str()); }

namespace {

/// What is wrong with the command line, and which --help to read.
Failure usage_failure(const CLI::App& app, const CLI::ParseError& error) {
  const std::vector<CLI::App*> called = app.get_subcommands();
  const std::string subcommand = called.empty() ? "" : called.front()->get_name();
  const std::string help =
      "; see tessera " + (subcommand.empty() ? "" : subcommand + " ") + "--help";
  // An unknown word explains more than the option that is missing because of it.
  const std::vector<std::string> unknown = app.remaining(true);
  if (unknown.empty()) return {error.what() + help};
  std::error_code unreadable;
  const bool reads_folders =
      !called.empty() && called.front()->get_option_no_throw("--dataset") != nullptr;
  if (reads_folders && std::filesystem::is_directory(unknown.front(), unreadable))
    return {"unknown option " + unknown.front() +
            "; if it is the folder of the scans, give --dataset " + unknown.front() + help};
  return {"unknown option or subcommand " + unknown.front() + help};
}

int run(int argc, char** argv) {
  CLI::App app("Dense semantic occupancy maps that teams of robots build and share");
  app.set_version_flag("--version", std::string("tessera ") + kVersion);
  app.require_subcommand(1);
  app.footer(
      "Example: tessera map --dataset sequence --out map.tsm; see each subcommand's --help.");
  int exit_status = kExitDone;
  add_map_command(app, exit_status);
  add_fuse_command(app, exit_status);
  add_align_command(app, exit_status);
  add_eval_command(app, exit_status);
  add_fit_kernels_command(app, exit_status);
  add_query_command(app, exit_status);
  add_export_command(app, exit_status);
  add_view_command(app, exit_status);
  add_info_command(app, exit_status);
  add_convert_command(app, exit_status);
  add_simulate_command(app, exit_status);
  add_node_command(app, exit_status);
  add_play_command(app, exit_status);
  add_doctor_command(app, exit_status);
  add_key_command(app, exit_status);
  add_pages_command(app, exit_status);
  const std::string_view first = argc > 1 ? argv[1] : "";
  bool known = first.empty() || first.starts_with('-');
  for (CLI::App* const sub : app.get_subcommands([](CLI::App*) { return true; })) {
    known = known || sub->get_name() == first;
    sub->set_version_flag("--version", std::string("tessera ") + kVersion);
  }
  // Before the parser, which would accept a --help after the word.
  if (!known) {
    return fail({"unknown option or subcommand " + std::string(first) + "; see tessera --help"});
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success)) return app.exit(error);
    return fail(usage_failure(app, error));
  }
  return exit_status;
}

}  // namespace

}  // namespace tessera

#if TESSERA_ASSERTS
extern "C" [[noreturn]] void tessera_assert_failed(const char* expression, const char* file,
                                                   int line) {
  std::fprintf(stderr, "tessera: assertion failed at %s:%d: %s\n", file, line, expression);
  std::abort();
}
#endif

int main(int argc, char** argv) {
  try {
    return tessera::run(argc, argv);
  } catch (const std::bad_alloc&) {
    return tessera::fail(
        {"out of memory; give a smaller --memory or fewer scans", tessera::FailureKind::kFailure});
  } catch (const std::exception& error) {
    return tessera::fail(
        {std::string("cannot continue: ") + error.what(), tessera::FailureKind::kFailure});
  }
}
