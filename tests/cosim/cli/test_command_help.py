"""What a program says when it is asked for help, or typed wrongly."""

from __future__ import annotations

import argparse
import shlex
from collections.abc import Iterator

import pytest

from cosim.cli import PROGRAM as COSIM
from fmus.cli import PROGRAM as FMUS
from fmus.cli.commands import CommandProgram, find_commands
from fmus.cli.parsers import Parser

PROGRAMS = {program.name: program for program in (COSIM, FMUS)}


def words_of(program: CommandProgram) -> Iterator[list[str]]:
    """The words that lead to each command, and to each of its actions."""
    for command in find_commands(program.package):
        yield [command.name]
        for action in program.parser([command.name])._actions:
            if isinstance(action, argparse._SubParsersAction):
                for below in action.choices[command.name]._actions:
                    if isinstance(below, argparse._SubParsersAction):
                        yield from ([command.name, name] for name in below.choices)


CASES = [(name, words) for name, program in PROGRAMS.items() for words in words_of(program)]


@pytest.mark.parametrize(("name", "words"), CASES, ids=lambda part: part if isinstance(part, str) else " ".join(part))
def test_every_help_ends_with_examples_that_can_be_typed(
    name: str, words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        PROGRAMS[name].parser(words).parse_args([*words, "--help"])
    assert ended.value.code == 0
    examples = capsys.readouterr().out.partition("\nexamples:\n")[2].splitlines()
    assert examples
    for line in examples:
        typed = shlex.split(line)
        assert typed[: 1 + len(words)] == [name, *words]
        assert callable(PROGRAMS[name].parser(typed[1:]).parse_args(typed[1:]).execute)


@pytest.mark.parametrize("program", PROGRAMS.values(), ids=list(PROGRAMS))
def test_a_program_alone_shows_what_users_come_for(
    program: CommandProgram, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert program.run([]) == 0
    shown = capsys.readouterr().out
    for task, typed in program.tasks:
        assert task in shown
        for line in typed.splitlines():
            assert line in shown
            first, *words = shlex.split(line)
            PROGRAMS[first].parser(words).parse_args(words)
    monkeypatch.setenv("COLUMNS", "40")
    assert program.run([]) == 0
    assert max(map(len, capsys.readouterr().out.splitlines())) <= 40


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("rn x.toml", "cosim: no command 'rn'; did you mean 'run'? (see 'cosim --help')"),
        ("vendor.toml", "cosim: 'vendor.toml' is no command; did you mean 'cosim run vendor.toml'?"),
        ("vendor.fmu", "cosim: 'vendor.fmu' is no command; did you mean 'cosim new vendor.fmu'?"),
        ("run x.toml --no-reprt", "cosim run: no option --no-reprt; did you mean --no-report?"),
        ("tune x.toml --parameters a=0:1 --judge 10:20", "cosim tune: --judge has become --validate (see"),
        ("run x.toml y.toml", "cosim run: not expected: y.toml"),
        ("baseline chek x.json", "cosim baseline: argument ACTION: invalid choice: 'chek'"),
        ("baseline check x.json --agains", "cosim baseline check: argument --against: expected one argument"),
        ("baseline check x.json --plotz", "cosim baseline check: no option --plotz; did you mean --plots?"),
        ("run x.toml --seeds many", "cosim run: argument --seeds: expected a whole number (got 'many')"),
        ("compare x", "cosim compare: the following arguments are required: B"),
    ],
)
def test_what_is_typed_wrongly_is_answered_in_one_line(
    line: str, expected: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        COSIM.run(line.split())
    shown = capsys.readouterr()
    assert (ended.value.code, shown.out) == (2, "")
    assert shown.err.startswith(expected)
    assert shown.err.count("\n") == 1


def test_colour_is_for_terminals_that_want_it(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def wrong(terminal: bool, **variables: str) -> str:
        for name in ("NO_COLOR", "TERM"):
            monkeypatch.delenv(name, raising=False)
        for name, value in variables.items():
            monkeypatch.setenv(name, value)
        monkeypatch.setattr("sys.stderr.isatty", lambda: terminal)
        with pytest.raises(SystemExit):
            Parser(prog="program").error("wrong")
        return capsys.readouterr().err

    text = "program: wrong (see 'program --help')\n"
    assert wrong(True) == f"\x1b[1;31mprogram:\x1b[0m{text.removeprefix('program:')}"
    assert wrong(True, NO_COLOR="1") == wrong(True, TERM="dumb") == wrong(False) == text
