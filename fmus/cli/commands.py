"""The commands of a program: one file a command, ``<name>_command.py`` in the room of the program, which says all of
it. Only the file of the command in use is loaded.

Such a file declares, as literals that are read without loading it, `GROUP`, under which the help lists it, `PLACE`, its
number there in order of use, `HELP`, one line, `LOOKS`, whether it only looks and so runs no code of others, and where
there are any `FORMER`, old spellings with what is typed now; then ``EXAMPLES``, lines as they are typed, ``PARSER``,
the keywords of its parser, ``ARGUMENTS``, what the parser takes, a function ``execute`` unless it consists of
`Actions`, and where there are any ``FORMER_OPTIONS``, options of today by their former names.
"""

from __future__ import annotations

import argparse
import ast
import io
import shlex
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from difflib import get_close_matches
from importlib import import_module
from itertools import groupby
from pathlib import Path
from typing import Any

from fmus.cli.completion import SHELLS, Names, completion_script
from fmus.cli.output import Output, UnwritableError
from fmus.cli.parsers import MISTAKE, Parser, print_error
from fmus.cli.signals import BROKEN_PIPE, forget_output
from fmus.cli.warning_lines import warnings_in_lines
from fmus.tables.table import Table, joined, name_column, text_column
from fmus.tables.terminal import terminal_width
from fmus.versions import version_text
from plant_models.code_trust import looking
from plant_models.missing_package import missing_package
from plant_models.module_loading import load_module

Execute = Callable[[argparse.Namespace], Output]
"""Runs a command with its options."""
_ENDING = "_command.py"
_DONE = 0
_COMPLETION = "--completion"


@dataclass(frozen=True)
class Command:
    """One command, as its file declares it.

    Args:
        name: as it is typed. group: under which the help lists it. place: within the group, from 1. help: one line.
        looks: whether it only looks. former: what is typed now, by old spellings.
    """

    name: str
    group: str
    place: int
    help: str
    looks: bool
    former: Mapping[str, str]


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
            below = subparsers.add_parser(action.name, **action.parser)
            below.examples = [line for line in parser.examples if line.startswith(f"{below.prog} ")]
            _fill(below, action.arguments, action.execute, action.looks)


@dataclass(frozen=True)
class Action:
    """One of several actions of a command.

    Args:
        name: as it is typed. execute: what it does. parser: keywords of its parser. arguments: what it takes.
        looks: whether it only looks.
    """

    name: str
    execute: Execute
    parser: Mapping[str, Any] = field(default_factory=dict)
    arguments: Sequence[Argument | ArgumentGroup] = ()
    looks: bool = False


def argument(*names: str, **keywords: Any) -> Argument:
    """An argument of a command.

    Args:
        names: its name, or its flags. keywords: as for `argparse.ArgumentParser.add_argument`.
    """
    return Argument(names, keywords)


def repeated(name: str, metavar: str, text: str, **keywords: Any) -> Argument:
    """An argument that may be stated several times; the command gets a list.

    Args:
        name: its flag. metavar: of one value. text: what the help says of it. keywords: as for `argument`.
    """
    return argument(name, action="append", default=[], metavar=metavar, help=f"{text}; may be repeated", **keywords)


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


def _add_command(subparsers: Any, name: str, module: Any) -> None:
    """Add the parser of a command.

    Args:
        subparsers: of the program. name: of the command. module: its file.
    """
    parser = subparsers.add_parser(name, **module.PARSER)
    parser.examples, parser.former = module.EXAMPLES, getattr(module, "FORMER_OPTIONS", {})
    _fill(parser, module.ARGUMENTS, getattr(module, "execute", None), module.LOOKS)


def _fill(
    parser: Any, arguments: Sequence[Argument | ArgumentGroup | Actions], execute: Execute | None, looks: bool
) -> None:
    _add_arguments(parser, arguments)
    if execute is not None:
        if "--verbose" not in parser._option_string_actions:
            parser.add_argument("--verbose", action="store_true", help="print warnings whole")
        parser.add_argument("--json", action="store_true", help="print the data as JSON instead of text")
        parser.set_defaults(execute=execute, looks=looks)


@dataclass(frozen=True)
class CommandProgram:
    """A program with commands.

    Args:
        name: of the program. description: one line. package: the room of the commands' files.
        groups: of commands, in the order of the help. tasks: what users come for, each with what they type: shown
            where nothing was typed. files: what is done with a file, by its ending, where no command was typed.
        names: what completion offers besides files, by the ``dest`` of an argument. expected: errors that are for the
            user.
        within: in what a command runs. in_words: what the user reads of an error and the options. allowed: asks the
            user whether what an error speaks of is to be allowed; the command is done again then.
    """

    name: str
    description: str
    package: str
    groups: Sequence[str]
    tasks: Sequence[tuple[str, str]]
    files: Mapping[str, str]
    names: Names
    expected: tuple[type[BaseException], ...]
    within: Callable[[], AbstractContextManager[None]]
    in_words: Callable[[BaseException, argparse.Namespace], str]
    allowed: Callable[[BaseException], bool]

    def run(self, words: Sequence[str]) -> int:
        """Run the command that was typed.

        Args:
            words: behind the name of the program.

        Returns:
            The exit code: that of the command, 2 for an error or an interruption, 141 where nobody reads any more.
        """
        for stream in (sys.stdout, sys.stderr):
            if isinstance(stream, io.TextIOWrapper):  # a terminal may know ASCII alone
                stream.reconfigure(errors="replace")
        if not words or words[0] == _COMPLETION:
            print(self.completion(" ".join(words[1:]) or "bash") if words else self.first_screen())
            return _DONE
        options = argparse.Namespace(command_line=shlex.join([self.name, *words]))
        try:  # reading the words loads the command, which may be interrupted too
            self.parser(words).parse_args(words, options)
            with self.within():
                with warnings_in_lines(whole=options.verbose):
                    output = self._done(options)
                return output.show(self.name, as_json=options.json)
        except BrokenPipeError:  # whoever read has seen enough, as `head` does
            forget_output()
            return BROKEN_PIPE
        except UnwritableError as error:
            forget_output()
            print_error(self.name, str(error))
        except self.expected as error:
            print_error(self.name, self.in_words(error, options))
        except ModuleNotFoundError as error:  # of an installation without what only some commands need
            if not (missing := missing_package(error)):
                raise
            print_error(self.name, missing)
        except KeyboardInterrupt:
            print_error(self.name, "interrupted.")
        return MISTAKE

    def _done(self, options: argparse.Namespace) -> Output:
        """What a command gives; where it only looks, no code of others is run."""
        with looking(options.looks and not getattr(options, "trust", False)):
            try:
                output: Output = options.execute(options)
            except self.expected as error:
                if not self.allowed(error):
                    raise
                output = options.execute(options)
        return output

    def first_screen(self) -> str:
        """What users come for, with the commands for it."""
        columns = [name_column("task"), text_column("commands")]
        tasks = Table("tasks", columns, [(f"  {task}", typed) for task, typed in self.tasks])
        more = f"All commands: {self.name} --help. Of one of them: {self.name} COMMAND --help."
        return joined([self.description, tasks, more], terminal_width())

    def completion(self, shell: str) -> str:
        """The script that completes its commands in a shell; all of them are loaded for it.

        Args:
            shell: a name of `SHELLS`; another one ends the program.
        """
        if shell not in SHELLS:
            Parser(prog=self.name).error(f"no completion for {shell!r}; there is one for {', '.join(SHELLS)}")
        names = [command.name for command in find_commands(self.package)]
        found = {name: _subparsers(self.parser([name])).choices[name] for name in names}
        return completion_script(shell, self.name, found, self.names)

    def parser(self, words: Sequence[str]) -> argparse.ArgumentParser:
        """The parser of the program; of the commands, only the one that is used is loaded.

        Args:
            words: behind the name of the program.
        """
        parser = Parser(prog=self.name, description=self.description, formatter_class=argparse.RawTextHelpFormatter)
        versions = "versions of the package and of what it runs on"
        parser.add_argument("--version", action=_Version, nargs=0, help=versions)
        shell = f'completion: eval "$({self.name} {_COMPLETION} bash)" or zsh; {self.name} {_COMPLETION} fish | source'
        parser.add_argument(_COMPLETION, choices=tuple(SHELLS), help=shell)
        how = f"one of those below; '{self.name} COMMAND --help' says what it takes"
        subparsers = parser.add_subparsers(dest="command", required=True, metavar="COMMAND", help=how)
        used = next((word for word in words if not word.startswith("-")), None)
        module = f"{used}{_ENDING}".replace("-", "_")
        if used is not None and used.replace("-", "").isalnum() and (_folder(self.package) / module).is_file():
            _add_command(subparsers, used, load_module(f"{self.package}.{module.removesuffix('.py')}"))
            return parser
        commands = find_commands(self.package)
        if used is not None:
            parser.error(_unknown(used, commands, self))
        parser.epilog = "commands:\n\n" + _listed(commands, self.groups)
        return parser


def find_commands(package: str) -> list[Command]:
    """The commands of a program, by name, without loading them.

    Args:
        package: the room of their files.
    """
    files = sorted(_folder(package).glob(f"*{_ENDING}"))
    return [_declared(file.name.removesuffix(_ENDING).replace("_", "-"), file) for file in files]


def _subparsers(parser: argparse.ArgumentParser) -> argparse._SubParsersAction[Any]:
    """Where the parsers of commands are."""
    return next(action for action in parser._actions if isinstance(action, argparse._SubParsersAction))


def _folder(package: str) -> Path:
    return Path(import_module(package).__path__[0])


def _declared(name: str, file: Path) -> Command:
    """What the file of a command declares of it."""
    assigned = [s for s in ast.parse(file.read_text(encoding="utf-8")).body if isinstance(s, ast.Assign)]
    literals = {ast.unparse(s.targets[0]): s.value for s in assigned}
    keys = ("GROUP", "PLACE", "HELP", "LOOKS", "FORMER")
    found = {key.lower(): ast.literal_eval(literals[key]) for key in keys if key in literals}
    return Command(name, **{"former": {}, **found})


def _unknown(name: str, commands: Sequence[Command], program: CommandProgram) -> str:
    """What a word is now that was a command, or what may be meant."""
    command = program.files.get(Path(name).suffix.lower())
    if command is not None:
        return f"{name!r} is no command; did you mean '{program.name} {command} {name}'?"
    former = {old: now for command in commands for old, now in command.former.items()}
    if name in former:
        return f"{name!r} has become: {former[name]}"
    names = [command.name for command in commands]
    near = get_close_matches(name, names, 1)
    return f"no command {name!r}; " + (f"did you mean {near[0]!r}?" if near else f"there are: {', '.join(names)}")


def _listed(commands: Sequence[Command], groups: Sequence[str]) -> str:
    """The commands with a line each, by groups, in the order of their places."""
    order = {group: i for i, group in enumerate(groups)}
    ordered = sorted(commands, key=lambda c: (order.get(c.group, len(order)), c.group, c.place, c.name))
    columns, width = [name_column("name"), text_column("help")], max(len(command.name) for command in commands)
    tables = [
        Table(group, columns, [(f"  {c.name:{width}}", c.help) for c in members], title=group)
        for group, members in groupby(ordered, key=lambda command: command.group)
    ]
    return "\n\n".join(table.text(terminal_width()) for table in tables)


class _Version(argparse.Action):
    """Print the versions and end."""

    def __call__(self, parser: argparse.ArgumentParser, *_: Any) -> None:
        print(f"{parser.prog}: {version_text()}")
        parser.exit()
