// SPDX-FileCopyrightText: The tessera authors
// SPDX-License-Identifier: Apache-2.0
#include "cli/setting_options.hpp"

#include <string>

namespace tessera {

namespace {

/// Sentence, range and default; options: with the defaults.
std::string help_text(const Setting& setting, const void* options) {
  std::string text(setting.sentence);
  if (const std::string range = stated_range(setting).text(); !range.empty()) text += "; " + range;
  std::string otherwise(setting.otherwise);
  if (otherwise.empty() && !setting.flag) otherwise = text_of(setting, setting.member.get(options));
  return otherwise.empty() ? text : text + " [" + otherwise + "]";
}

}  // namespace

std::string value_name(const Setting& setting) {
  if (!setting.value.empty()) return std::string(setting.value);
  if (setting.kind == SettingKind::kSwitch) return "on|off";
  std::string name;
  for (const std::string_view word : setting.words())
    name += (name.empty() ? "" : "|") + std::string(word);
  return name;
}

void detail::declare_setting(CLI::App& command, const Setting& setting, void* options) {
  const std::string name(setting.name.option);
  if (setting.flag) {
    command.add_flag_callback(
        name, [&setting, options] { setting.member.set(options, true); },
        help_text(setting, options));
    return;
  }
  CLI::Option* const option = command.add_option_function<std::string>(
      name,
      [&setting, options](const std::string& text) {
        const Outcome<SettingValue> value = parse_value(setting, text);
        if (!value.ok())
          throw CLI::ValidationError(value.failure().text(), CLI::ExitCodes::ValidationError);
        setting.member.set(options, *value);
      },
      help_text(setting, options));
  option->type_name(value_name(setting));
  option->required(!setting.required.empty());
}

void declare_without(CLI::App& command, std::vector<std::uint16_t>& without) {
  command
      .add_option("--without", without,
                  "Raw ids of the truth whose points do not count; what was seen to move in "
                  "SemanticKITTI: 252,253,254,255,256,257,258,259")
      ->delimiter(',')
      ->type_name("ID");
}

}  // namespace tessera
