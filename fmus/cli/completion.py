"""Completion in a shell: a script for bash, zsh or fish, made from the parsers once: no program starts while somebody
types.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

Names = Mapping[str, Callable[[], Sequence[str]]]
"""What can be typed for an argument besides a file, by the argument's ``dest``."""

_POSIX_WORDS = """\
_{name}_words() {{
  case "$1" in
{cases}
  esac
}}
"""
_BASH = """\
# completion of {name}: eval "$({name} --completion bash)"
{words}_{name}() {{
  local typed="${{COMP_WORDS[COMP_CWORD]}}" last="${{COMP_WORDS[COMP_CWORD-1]}}" before="" word found=""
  for word in "${{COMP_WORDS[@]:1:COMP_CWORD-1}}"; do
    case "$word" in -*) continue ;; esac
    [ -n "$(_{name}_words "$before $word")" ] && before="$before $word"
  done
  COMPREPLY=()
  case "$last" in -*) found="$(_{name}_words "$before $last")" ;; esac
  if [ -n "$found" ]; then
    COMPREPLY=($(compgen -W "$found" -- "$typed"))
    return
  fi
  for word in $(_{name}_words "$before"); do
    case "$typed/$word" in -*/-*) found="$found $word" ;; -*/*|*/-*) ;; *) found="$found $word" ;; esac
  done
  COMPREPLY=($(compgen -W "$found" -- "$typed"))
  local IFS=$'\\n'
  [ -n "$before" ] && COMPREPLY+=($(compgen -f -- "$typed"))
}}
complete -o filenames -F _{name} {name}
"""
_ZSH = """\
# completion of {name}: eval "$({name} --completion zsh)"
{words}_{name}() {{
  local before="" word last="${{words[CURRENT-1]}}"
  local -a found
  for word in "${{(@)words[2,CURRENT-1]}}"; do
    [[ "$word" != -* && -n "$(_{name}_words "$before $word")" ]] && before="$before $word"
  done
  [[ "$last" == -* ]] && found=(${{=$(_{name}_words "$before $last")}})
  if (( $#found )); then
    compadd -a found
    return
  fi
  found=(${{=$(_{name}_words "$before")}})
  if [[ "${{words[CURRENT]}}" == -* ]]; then found=(${{(M)found:#-*}}); else found=(${{found:#-*}}); fi
  compadd -a found
  [[ -n "$before" ]] && _files
}}
(( $+functions[compdef] )) || {{ autoload -Uz compinit && compinit -u; }}
compdef _{name} {name}
"""
_FISH = """\
# completion of {name}: {name} --completion fish | source
function __{name}_words
  switch "$argv[1]"
{cases}
  end
end
function __{name}_complete
  set -l tokens (commandline -opc)
  set -l before ''
  for word in $tokens[2..-1]
    string match -q -- '-*' "$word"; and continue
    test -n "$(__{name}_words "$before $word")"; and set before "$before $word"
  end
  set -l found ''
  string match -q -- '-*' "$tokens[-1]"; and set found "$(__{name}_words "$before $tokens[-1]")"
  if test -n "$found"
    string split ' ' -- $found
    return
  end
  string split ' ' -- (__{name}_words "$before")
  test -n "$before"; and __fish_complete_path (commandline -ct)
end
complete -c {name} -f -a '(__{name}_complete)'
"""
SHELLS = {"bash": _BASH, "zsh": _ZSH, "fish": _FISH}
"""Scripts, by the names of the shells."""


def completion_script(shell: str, name: str, parsers: Mapping[str, argparse.ArgumentParser], names: Names) -> str:
    """The script.

    Args:
        shell: one of `SHELLS`. name: of the program. parsers: of its commands, by name. names: besides files.
    """
    found = {"": " ".join([*parsers, "--help", "--version"])}
    for command, parser in parsers.items():
        for before, below in _below(f" {command}", parser):
            found[before] = " ".join(_words(below, names))
            found |= {f"{before} {option}": " ".join(values) for option, values in _values(below, names)}
    if shell == "fish":
        cases = "\n".join(f"    case '{before}'\n      echo {words}" for before, words in found.items())
        return _FISH.format(name=name, cases=cases)
    cases = "\n".join(f"    '{before}') echo {words} ;;" for before, words in found.items())
    return SHELLS[shell].format(name=name, words=_POSIX_WORDS.format(name=name, cases=cases))


def _below(before: str, parser: argparse.ArgumentParser) -> Iterator[tuple[str, argparse.ArgumentParser]]:
    """A parser and those of its actions, with the words before."""
    yield before, parser
    for group in parser._actions:
        if isinstance(group, argparse._SubParsersAction):
            for action, below in group.choices.items():
                yield from _below(f"{before} {action}", below)


def _words(parser: argparse.ArgumentParser, names: Names) -> Iterator[str]:
    """What can be typed next: actions, names, options by their long names where they have one."""
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            yield from action.choices
        elif action.option_strings:
            yield action.option_strings[-1]
        else:
            yield from _known(action, names)


def _values(parser: argparse.ArgumentParser, names: Names) -> Iterator[tuple[str, Iterable[str]]]:
    """Options of which it is known what can be typed behind them."""
    for action in parser._actions:
        known = _known(action, names) if action.option_strings and action.nargs != 0 else ()
        if known:
            yield from ((option, known) for option in action.option_strings)


def _known(action: argparse.Action, names: Names) -> Sequence[str]:
    return [str(choice) for choice in action.choices] if action.choices else names.get(action.dest, tuple)()
