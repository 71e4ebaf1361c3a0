"""The commands of a program: what its help says of them, and their files, of which only that of the command in use is
loaded. A file declares its arguments as a table.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any

from fmus.versions import version_text

Execute = Callable[[argparse.Namespace], int]
"""Runs a command with its options and returns the exit code."""


@dataclass(frozen=True)
class Command:
    """One command.

    Args:
        name: as it is typed. module: its file, with ``PARSER``, the keywords of its parser, ``ARGUMENTS``, what its
            parser takes, and a function ``execute`` unless it consists of `Actions`. help: one line for the list of
            commands.
    """

    name: str
    module: str
    help: str


@dataclass(frozen=True)
class Argument:
    """An argument of a command: names and keywords of `argparse.ArgumentParser.add_argument`."""

    names: tuple[str, ...]
    keywords: Mapping[str, Any]

    def add_to(self, parser: Any) -> None:
        """Add it to a parser or to a group of one."""
        parser.add_argument(*self.names, **self.keywords)


@dataclass(frozen=True)
class ArgumentGroup:
    """Arguments that the help shows together, or of which one at most is given.

    Args:
        arguments: in the order of the help. title, description: of the group in the help; without a title the
            arguments exclude one another.
    """

    arguments: Sequence[Argument | ArgumentGroup]
    title: str | None = None
    description: str | None = None

    def add_to(self, parser: Any) -> None:
        """Add them to a parser or to a group of one."""
        if self.title is None:
            added = parser.add_mutually_exclusive_group()
        else:
            added = parser.add_argument_group(self.title, self.description)
        _add_arguments(added, self.arguments)


@dataclass(frozen=True)
class Actions:
    """Several actions of one command, each with arguments of its own.

    Args:
        actions: in the order of the help.
    """

    actions: Sequence[Action]

    def add_to(self, parser: Any) -> None:
        """Add them to the parser of the command."""
        subparsers = parser.add_subparsers(dest="action", required=True, metavar="ACTION")
        for action in self.actions:
            _fill(subparsers.add_parser(action.name, **action.parser), action.arguments, action.execute)


@dataclass(frozen=True)
class Action:
    """One of several actions of a command.

    Args:
        name: as it is typed. execute: what it does. parser: keywords of its parser. arguments: what it takes.
    """

    name: str
    execute: Execute
    parser: Mapping[str, Any] = field(default_factory=dict)
    arguments: Sequence[Argument | ArgumentGroup] = ()


def argument(*names: str, **keywords: Any) -> Argument:
    """An argument of a command.

    Args:
        names: its name, or its flags. keywords: as for `argparse.ArgumentParser.add_argument`.
    """
    return Argument(names, keywords)


def one_of(*arguments: Argument) -> ArgumentGroup:
    """Arguments of which one at most is given.

    Args:
        arguments: in the order of the help.
    """
    return ArgumentGroup(arguments)


def _add_arguments(parser: Any, arguments: Sequence[Argument | ArgumentGroup | Actions]) -> None:
    """Add arguments to a parser or to a group of one."""
    for entry in arguments:
        entry.add_to(parser)


def add_command(subparsers: Any, name: str, module: Any) -> None:
    """Add the parser of a command.

    Args:
        subparsers: of the program. name: of the command. module: its file, see `Command`.
    """
    _fill(subparsers.add_parser(name, **module.PARSER), module.ARGUMENTS, getattr(module, "execute", None))


def _fill(parser: Any, arguments: Sequence[Argument | ArgumentGroup | Actions], execute: Execute | None) -> None:
    _add_arguments(parser, arguments)
    if execute is not None:
        parser.set_defaults(execute=execute)


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
            add_command(subparsers, command.name, import_module(command.module))
        else:
            subparsers.add_parser(command.name, help=command.help)
    return parser


class _Version(argparse.Action):
    """Print the versions and end."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        print(f"{parser.prog}: {version_text()}")
        parser.exit()
