// SPDX-License-Identifier: Apache-2.0
#include "app/manual.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <sstream>
#include <vector>

#include "absl/strings/str_replace.h"
#include "facetwise/engine.h"

namespace facetwise::app {
namespace {

std::string escaped(const std::string& text) { return absl::StrReplaceAll(text, {{"\\", "\\e"}, {"-", "\\-"}}); }

// A text with its line breaks; lines that are indented as they are.
std::string paragraphs(const std::string& text) {
  std::string out;
  std::istringstream lines(text);
  bool verbatim = false;
  for (std::string line; std::getline(lines, line);) {
    const bool indented = line.starts_with("  ");
    if (indented != verbatim) out += indented ? ".nf\n" : ".fi\n";
    verbatim = indented;
    if (line.empty())
      out += ".PP\n";
    else
      out += (line.starts_with('.') || line.starts_with('\'') ? "\\&" : "") + escaped(line) + "\n";
  }
  return out + (verbatim ? ".fi\n" : "");
}

std::string options(const CLI::App& command) {
  std::string out;
  for (const CLI::Option* option : command.get_options()) {
    if (option->get_group().empty()) continue;
    const std::string value = option->get_option_text().empty() ? option->get_type_name() : option->get_option_text();
    const bool takes_value = option->get_type_size() != 0 || !option->get_option_text().empty();
    out += fmt::format(".TP\n\\fB{}\\fR {}\n{}\n", escaped(option->get_name(false, true)),
                       takes_value ? escaped(value) : "", escaped(option->get_description()));
  }
  return out;
}

}  // namespace

std::string manual_page(const CLI::App& app) {
  std::string out = fmt::format(
      ".TH FACETWISE 1 \"\" \"facetwise {}\"\n.SH NAME\nfacetwise \\- microfacet normals and reflections in bulk\n"
      ".SH SYNOPSIS\n\\fBfacetwise\\fR \\fIVERB\\fR [\\fIOPTION\\fR ...]\n.SH DESCRIPTION\n{}",
      version(), paragraphs(app.get_description()));
  for (const CLI::App* verb : app.get_subcommands({}))
    out += fmt::format(".SH {}\n{}.PP\n{}.PP\n{}", escaped(verb->get_name()), paragraphs(verb->get_description()),
                       options(*verb), paragraphs(verb->get_footer()));
  return out + ".SH EXAMPLES AND EXIT CODES\n" + paragraphs(app.get_footer());
}

std::string bash_completion(const CLI::App& app) {
  const auto flags = [](const CLI::App& command) {
    std::vector<std::string> out;
    for (const CLI::Option* option : command.get_options())
      for (const std::string& name : option->get_lnames()) out.push_back("--" + name);
    return fmt::format("{}", fmt::join(out, " "));
  };
  std::vector<std::string> verbs;
  std::string flags_of, values_of;
  for (const CLI::App* verb : app.get_subcommands({})) {
    verbs.push_back(verb->get_name());
    flags_of += fmt::format("      {}) words=\"{}\" ;;\n", verb->get_name(), flags(*verb));
    // Options whose values have names: a|b|c.
    for (const CLI::Option* option : verb->get_options())
      if (const std::string names = option->get_type_name(); names.find('|') != std::string::npos)
        values_of += fmt::format("      {}:--{}) words=\"{}\" ;;\n", verb->get_name(), option->get_lnames().front(),
                                 absl::StrReplaceAll(names, {{"|", " "}}));
  }
  return fmt::format(R"(# Completion of facetwise in bash: made by the command itself.
_facetwise() {{
  local word=${{COMP_WORDS[COMP_CWORD]}} verb=${{COMP_WORDS[1]}} words=
  if [ "$COMP_CWORD" = 1 ]; then
    words="{} {}"
  elif [ "${{word#-}}" != "$word" ]; then
    case $verb in
{}    esac
  else
    case $verb:${{COMP_WORDS[COMP_CWORD-1]}} in
{}    esac
  fi
  if [ -n "$words" ]; then
    mapfile -t COMPREPLY < <(compgen -W "$words" -- "$word")
  else
    mapfile -t COMPREPLY < <(compgen -f -- "$word")
  fi
}}
complete -o filenames -F _facetwise facetwise
)",
                     fmt::join(verbs, " "), flags(app), flags_of, values_of);
}

}  // namespace facetwise::app
