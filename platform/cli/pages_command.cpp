// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
// tessera pages: manual pages and the completion for bash, generated from what the subcommands
// declare. For the build, so --help does not show it.
#include <filesystem>
#include <span>

#include "base/atomic_file.hpp"
#include "cli/bash_completion.hpp"
#include "cli/command.hpp"
#include "cli/manual_page.hpp"
#include "cli/reference_tables.hpp"
#include "cli/setting_options.hpp"
#include "cli/value_names.hpp"

namespace tessera {

namespace {

Outcome<void> write_text(const std::string& text, const std::string& path) {
  TESSERA_TRY_ASSIGN(AtomicFile file, AtomicFile::open(path));
  file.write(std::as_bytes(std::span(text)));
  return file.commit();
}

struct PagesOptions {
  std::string manual;
  std::string bash;
  std::string tables;
};

constexpr Setting kPagesRows[] = {
    path_row<&PagesOptions::manual>({"--man"}, "Folder to write tessera.1, tessera-map.1, ... into",
                                    {.value = "DIR"}),
    path_row<&PagesOptions::bash>({"--bash"}, "Bash completion file to write", {.value = "FILE"}),
    path_row<&PagesOptions::tables>(
        {"--tables"}, "File to write the tables of settings into, for the pages of docs/reference",
        {.value = "FILE"}),
};
constexpr SettingTable<PagesOptions> kPagesSettings{kPagesRows};

Outcome<void> run_pages(const CLI::App& app, const PagesOptions& options) {
  const auto& [manual, bash, tables] = options;
  if (manual.empty() && bash.empty() && tables.empty())
    return Failure{"give --man DIR, --bash FILE or --tables FILE; see tessera pages --help"};
  if (!manual.empty()) {
    std::error_code error;
    std::filesystem::create_directories(manual, error);
    if (error) return Failure{"cannot make the folder " + manual + ": " + error.message()};
    TESSERA_TRY(write_text(manual_page(app), manual + "/tessera.1"));
    for (const CLI::App* const command : shown_subcommands(app)) {
      TESSERA_TRY(
          write_text(manual_page_of(*command), manual + "/tessera-" + command->get_name() + ".1"));
    }
  }
  if (!bash.empty()) {
    TESSERA_TRY(write_text(bash_completion(app), bash));
  }
  return tables.empty() ? Outcome<void>() : write_text(reference_tables(app), tables);
}

}  // namespace

void add_pages_command(CLI::App& app, int& exit_status) {
  CLI::App* const command =
      app.add_subcommand("pages", "Write manual pages and completions, for installing");
  command->group("");
  auto o = std::make_shared<PagesOptions>();
  declare_settings(*command, kPagesSettings, *o);
  command->footer("Example: tessera pages --man man1 --bash tessera.bash");
  command->callback([&app, o, &exit_status] {
    const Outcome<void> outcome = run_pages(app, *o);
    if (!outcome.ok()) exit_status = fail(outcome.failure());
  });
}

}  // namespace tessera
