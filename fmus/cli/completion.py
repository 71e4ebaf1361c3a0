"""Completion in a shell: a script for bash, which zsh reads after ``bashcompinit``, made from the parsers once: no
program starts while somebody types.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Mapping

_SCRIPT = """\
# completion of {name} for bash and zsh: eval "$({name} --completion)"
if [ -n "${{ZSH_VERSION-}}" ]; then autoload -U +X bashcompinit; bashcompinit; fi
_{name}_words() {{
  case "$1" in
{cases}
  esac
}}
_{name}() {{
  local typed="${{COMP_WORDS[COMP_CWORD]}}" before="" word words
  for word in "${{COMP_WORDS[@]:1:COMP_CWORD-1}}"; do
    [ -n "$(_{name}_words "$before $word")" ] && before="$before $word"
  done
  words="$(_{name}_words "$before")"
  case "$typed" in
    -*) ;;
    *) words="$(echo "$words" | tr ' ' '\\n' | grep -v '^-')" ;;
  esac
  COMPREPLY=($(compgen -W "$words" -- "$typed"))
  [ -n "$before" ] && COMPREPLY+=($(compgen -f -- "$typed"))
}}
complete -o filenames -F _{name} {name}
"""


def completion_script(name: str, parsers: Mapping[str, argparse.ArgumentParser]) -> str:
    """The script.

    Args:
        name: of the program. parsers: of its commands, by name.
    """
    cases = [_case("", [*parsers, "--help", "--version"])]
    for command, parser in parsers.items():
        actions = {
            action: below
            for group in parser._actions
            if isinstance(group, argparse._SubParsersAction)
            for action, below in group.choices.items()
        }
        cases.append(_case(f" {command}", [*actions, *_options(parser)]))
        cases += [_case(f" {command} {action}", _options(below)) for action, below in actions.items()]
    return _SCRIPT.format(name=name, cases="\n".join(cases))


def _case(before: str, words: Iterable[str]) -> str:
    return f"    {before!r}) echo {' '.join(words)} ;;"


def _options(parser: argparse.ArgumentParser) -> list[str]:
    """The options of a parser, by their long names where they have one."""
    return [action.option_strings[-1] for action in parser._actions if action.option_strings]
