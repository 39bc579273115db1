// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/manual_page.hpp"

#include <cctype>
#include <string_view>
#include <vector>

#include "cli/value_names.hpp"
#include "tessera/base/version.hpp"

namespace tessera {

namespace {

/// Escapes text for roff.
std::string plain(std::string_view text) {
  std::string out;
  for (const char c : text) {
    const bool line_begins = out.empty() || out.back() == '\n';
    if (line_begins && (c == '.' || c == '\'')) out += "\\&";
    if (c == '\\') {
      out += "\\e";
    } else if (c == '-') {
      out += "\\-";
    } else {
      out += c;
    }
  }
  return out;
}

std::string bold(std::string_view text) { return "\\fB" + plain(text) + "\\fR"; }
std::string italic(std::string_view text) { return "\\fI" + plain(text) + "\\fR"; }

std::string heading(const std::string& page, std::string_view what) {
  std::string upper;
  for (const char c : page) upper += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return ".TH " + plain(upper) + " 1 \"\" \"tessera " + kVersion +
         "\" \"User Commands\"\n.SH NAME\n" + plain(page) + " \\- " + plain(what) + "\n";
}

std::string value_text(const CLI::Option& option) {
  if (is_flag(option)) return "";
  std::string text = italic(option.get_type_name());
  if (option.get_expected_max() > 1) text += " ...";
  return text;
}

void add_options(const CLI::App& command, std::string& page) {
  for (const CLI::Option* const option : command.get_options()) {
    const std::string name = option->get_name(false, true);
    page += ".TP\n";
    if (option->get_positional()) {
      page += italic(name) + "\n";
    } else {
      std::string names = bold(name);
      for (std::size_t comma = names.find(','); comma != std::string::npos;
           comma = names.find(',', comma + 3))
        names.replace(comma, 1, ", ");
      const std::string value = value_text(*option);
      page += names + (value.empty() ? "" : " " + value) + "\n";
    }
    page += plain(option->get_description());
    if (option->get_required()) page += ". Required";
    page += ".\n";
  }
}

/// The text after "Example:" in a footer, one command per paragraph.
void add_example(const CLI::App& command, std::string& page) {
  constexpr std::string_view kWord = "Example: ";
  std::string text = command.get_footer();
  if (!text.starts_with(kWord)) return;
  text = text.substr(kWord.size());
  page += ".SH EXAMPLE\n.nf\n" + plain(text) + "\n.fi\n";
}

constexpr const char* kExitStatus =
    ".SH EXIT STATUS\n.TP\n0\nDone. Warnings, if any, are on standard error.\n"
    ".TP\n1\nBad input or usage. One line on standard error says what is wrong, where, and what to "
    "do.\n"
    ".TP\n2\nThe work could not be completed.\n";

std::string synopsis_of(const CLI::App& command, const std::string& words) {
  std::string line = ".B " + plain(words) + "\n";
  for (const CLI::Option* const option : command.get_options()) {
    if (!option->get_required()) continue;
    const std::string name = option->get_name();
    line += option->get_positional() ? italic(name) + (option->get_expected_max() > 1 ? " ..." : "")
                                     : bold(name) + " " + value_text(*option);
    line += "\n";
  }
  return line + "[" + italic("option") + " ...]\n";
}

}  // namespace

std::string manual_page(const CLI::App& app) {
  std::string page = heading("tessera", app.get_description());
  page +=
      ".SH SYNOPSIS\n.B tessera\n" + italic("subcommand") + "\n[" + italic("option") + " ...]\n";
  page +=
      ".SH DESCRIPTION\nMakes maps of voxels from labelled range data. Each voxel is free, "
      "occupied or unknown, and has a class "
      "with its probability. Each subcommand has its own page.\n.SH "
      "SUBCOMMANDS\n";
  for (const CLI::App* const command : shown_subcommands(app))
    page += ".TP\n" + bold(command->get_name()) + "\n" + plain(command->get_description()) + ".\n";
  page += ".SH OPTIONS\n";
  add_options(app, page);
  add_example(app, page);
  page += kExitStatus;
  page += ".SH SEE ALSO\n";
  for (const CLI::App* const command : shown_subcommands(app))
    page += ".BR tessera\\-" + plain(command->get_name()) + " (1)" +
            (command == shown_subcommands(app).back() ? "\n" : ",\n");
  return page;
}

std::string manual_page_of(const CLI::App& command) {
  const std::string name = "tessera " + command.get_name();
  std::string page = heading("tessera-" + command.get_name(), command.get_description());
  page += ".SH SYNOPSIS\n";
  const std::vector<const CLI::App*> inner = shown_subcommands(command);
  if (inner.empty()) page += synopsis_of(command, name);
  for (const CLI::App* const part : inner)
    page +=
        (part == inner.front() ? "" : ".br\n") + synopsis_of(*part, name + " " + part->get_name());
  page += ".SH DESCRIPTION\n" + plain(command.get_description()) + ".\n";
  page += ".SH OPTIONS\n";
  add_options(command, page);
  for (const CLI::App* const part : inner) {
    page += ".SS " + plain(part->get_name()) + "\n" + plain(part->get_description()) + ".\n";
    add_options(*part, page);
  }
  add_example(command, page);
  page += kExitStatus;
  page += ".SH SEE ALSO\n.BR tessera (1)\n";
  return page;
}

}  // namespace tessera
