"""The commands of a program: what its help says of them, and their files, of which only that of the command in use is
loaded.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any

from fmus.versions import version_text


@dataclass(frozen=True)
class Command:
    """One command.

    Args:
        name: as it is typed. module: its file, with a function ``register(commands)`` that adds its parser and sets
            ``execute``. help: one line for the list of commands.
    """

    name: str
    module: str
    help: str


def make_parser(
    program: str, description: str, commands: Sequence[Command], arguments: Sequence[str]
) -> argparse.ArgumentParser:
    """The parser of a program; of the commands, only the one that is used is loaded.

    Args:
        program: its name. description: one line. commands: in the order of the help. arguments: words after the name.
    """
    parser = argparse.ArgumentParser(prog=program, description=description)
    parser.add_argument("--version", action=_Version, nargs=0, help="versions of the package and of what it runs on")
    subparsers = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    used = next((word for word in arguments if not word.startswith("-")), None)
    for command in commands:
        if command.name == used:
            import_module(command.module).register(subparsers)
        else:
            subparsers.add_parser(command.name, help=command.help)
    return parser


class _Version(argparse.Action):
    """Print the versions and end."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        print(f"{parser.prog}: {version_text()}")
        parser.exit()
