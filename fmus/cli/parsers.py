"""The parsers of a program: what a mistake on the command line is answered with, in one line, and how help reads."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from textwrap import fill
from typing import Any, NoReturn

from fmus.cli.colour import coloured
from fmus.plain import plain
from plant_models.meant_number import meant_number

MISTAKE = 2
"""Exit code of a mistake on the command line."""


_REFUSED = re.compile(r"invalid (int|float) value: '(.*)'")
"""What argparse says where a value is no number."""


class _Help(argparse.HelpFormatter):
    """Help in paragraphs; those that begin with blanks stay as they are, as examples do."""

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        paragraphs = text.split("\n\n")
        return "\n\n".join(p if p.startswith(" ") or "\n  " in p else fill(p, width) for p in paragraphs)


class Parser(argparse.ArgumentParser):
    """A parser that answers a mistake with one line, and an option that is none with the nearest that is one.

    Attributes:
        examples: lines as they are typed, which the help ends with.
        former: options of today by their former names.

    Args:
        more: as for `argparse.ArgumentParser`.
    """

    def __init__(self, **more: Any) -> None:
        super().__init__(**{"formatter_class": _Help, **more})
        self.examples: Sequence[str] = ()
        self.former: Mapping[str, str] = {}

    def format_help(self) -> str:
        """As `argparse.ArgumentParser.format_help`, with the examples."""
        shown = "".join(f"  {line}\n" for line in self.examples)
        return super().format_help() + (f"\nexamples:\n{shown}" if shown else "")

    def error(self, message: str) -> NoReturn:
        """Print what is wrong and where the help is, and end.

        Args:
            message: what is wrong.

        Raises:
            SystemExit: in any case.
        """
        message = _REFUSED.sub(lambda found: no_number(found[2], whole=found[1] == "int"), message)
        print_error(self.prog, f"{message} (see '{self.prog} --help')")
        raise SystemExit(MISTAKE)

    def parse_args(self, args: Any = None, namespace: Any = None) -> Any:
        """As `argparse.ArgumentParser.parse_args`.

        Args:
            args: the words. namespace: that options are put into.
        """
        options, unknown = self.parse_known_args(args, namespace)
        if unknown:
            self._used(list(args or ()))._refuse(unknown)
        return options

    def _used(self, words: Sequence[str]) -> Parser:
        """The parser of the command, or of its action, that the words begin with."""
        for action in self._actions:
            if isinstance(action, argparse._SubParsersAction) and words and words[0] in action.choices:
                below: Parser = action.choices[words[0]]
                return below._used(words[1:])
        return self

    def _refuse(self, unknown: Sequence[str]) -> NoReturn:
        """End because of words that nothing takes."""
        now = self.former.get(unknown[0].partition("=")[0])
        if now is not None:
            self.error(f"{unknown[0]} has become {now}")
        known = [option for action in self._actions for option in action.option_strings]
        near = get_close_matches(unknown[0].partition("=")[0], known, 1) if unknown[0].startswith("-") else []
        if near == ["--set"] and unknown[0].partition("=")[0] not in ("--se", "--sets"):
            near = [f"--set {unknown[0].partition('=')[0].lstrip('-')}=VALUE"]
        self.error(f"no option {unknown[0]}; did you mean {near[0]}?" if near else f"not expected: {' '.join(unknown)}")


def no_number(text: str, *, whole: bool = False) -> str:
    """What to answer where a text is no number.

    Args:
        text: as it was typed. whole: whether a whole number was expected.
    """
    kind = "a whole number" if whole else "a number"
    return f"expected {kind}{meant_number(text, whole=whole) or ('' if whole else ', such as 0.1')} (got {text!r})"


def print_error(program: str, text: str) -> None:
    """Print what went wrong to standard error.

    Args:
        program: its name. text: of the error; of others, perhaps.
    """
    print(f"{coloured(f'{program}:', 'bad', sys.stderr)} {plain(text)}", file=sys.stderr, flush=True)
