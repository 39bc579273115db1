// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/bash_completion.hpp"

#include <fmt/core.h>

#include <string_view>

#include "cli/value_names.hpp"

namespace tessera {

namespace {

// Finds what may follow the words so far. COMP_WORDS has --view=top as three words.
constexpr std::string_view kBegin = R"(# SPDX-License-Identifier: Apache-2.0
# Bash completion of tessera; tessera generates it from its own options.
_tessera_reply() { # CHOICES KIND EXTENSION: completions of the current word
  local IFS=$'\n'
  COMPREPLY=($(compgen -W "${1// /$'\n'}" -- "$current"))
  case $2 in
    files)
      compopt -o filenames 2>/dev/null
      if [ -n "$3" ]; then
        COMPREPLY+=($(compgen -d -- "$current") $(compgen -f -X "!*$3" -- "$current"))
      else
        COMPREPLY+=($(compgen -f -- "$current"))
      fi ;;
    folders)
      compopt -o filenames 2>/dev/null
      COMPREPLY+=($(compgen -d -- "$current")) ;;
  esac
}

_tessera() {
  local current=${COMP_WORDS[COMP_CWORD]} path='' option='' words='' choices='' kind='' extension='' takes=0 after=0 at=1 word
  COMPREPLY=()
  [ "$current" != = ] || current=''
  while [ $at -lt "$COMP_CWORD" ]; do
    word=${COMP_WORDS[at]}
    at=$((at + 1))
    case $word in
      =) after=0 ;;
      -*) option=$word after=0 ;;
      *)
        after=$((after + 1))
        if [ -z "$option" ]; then
          case "$path $word" in
)";

constexpr std::string_view kEnd = R"(    *) return ;;
  esac
  # After the values of the option comes the next option, or an argument without one.
  if [ -z "$option" ] || [ $after -ge $takes ] || [ "${current#-}" != "$current" ]; then
    case $current in
      -*) choices=$words kind='' extension='' ;;
      *) choices=$commands kind=$plain_kind extension=$plain_extension ;;
    esac
  fi
  [ -n "$current" ] || [ -n "$choices$kind" ] || choices=$words
  _tessera_reply "$choices" "$kind" "$extension"
}
complete -F _tessera tessera
)";

std::string kind_word(const ValueKind& kind) {
  return kind.files ? "files" : kind.folders ? "folders" : "''";
}

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
}

/// Lines that name the subcommands, so that their path is followed.
void add_paths(const CLI::App& command, const std::string& path, std::string& script) {
  for (const CLI::App* const inner : shown_subcommands(command)) {
    const std::string inner_path = path + " " + inner->get_name();
    script += "            '" + inner_path + "') path='" + inner_path + "' ;;\n";
    add_paths(*inner, inner_path, script);
  }
}

/// What may follow a path: its options, their values, its subcommands, arguments without an option.
void add_level(const CLI::App& command, const std::string& path, std::string& script) {
  std::vector<std::string> words;
  std::vector<std::string> commands;
  std::string cases;
  ValueKind plain;
  for (const CLI::Option* const option : command.get_options()) {
    const ValueKind kind = is_flag(*option) ? ValueKind{} : kind_of(*option);
    if (option->get_positional()) {
      plain = kind;
      continue;
    }
    for (const std::string& name : option->get_lnames()) words.push_back("--" + name);
    if (is_flag(*option)) continue;
    const int most = std::min(option->get_items_expected_max(), 99);
    cases += fmt::format("        {}) takes={} choices='{}' kind={} extension='{}' ;;\n",
                         option->get_name(), most, joined(kind.choices), kind_word(kind),
                         kind.extension);
  }
  const std::vector<const CLI::App*> inner = shown_subcommands(command);
  for (const CLI::App* const part : inner) commands.push_back(part->get_name());
  script += "    '" + path + "')\n      words='" + joined(words) + "'\n      commands='" +
            joined(commands) + "' plain_kind=" + kind_word(plain) + " plain_extension='" +
            plain.extension + "'\n";
  if (!cases.empty()) script += "      case $option in\n" + cases + "      esac\n";
  script += "      ;;\n";
  for (const CLI::App* const part : inner) add_level(*part, path + " " + part->get_name(), script);
}

}  // namespace

std::string bash_completion(const CLI::App& app) {
  std::string script(kBegin);
  add_paths(app, "", script);
  script +=
      "            *) [ -n \"$path\" ] || return ;;\n          esac\n        fi ;;\n    esac\n  "
      "done\n"
      "  local commands='' plain_kind='' plain_extension=''\n"
      "  case $path in\n";
  add_level(app, "", script);
  script += kEnd;
  return script;
}

}  // namespace tessera
