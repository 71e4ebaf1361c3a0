"""Loops in generated C: statements that repeat element by element become one loop over the elements.

CasADi writes the copy of a vector as one statement for each element, and compilers take minutes for thousands of them.
A loop executes the same statements in the same order, so that the numbers stay what they were. It knows the form in
which CasADi writes statements (`a12 = w[7];`), and no equations.
"""

from __future__ import annotations

import re
from typing import NamedTuple

from fmus.content.casadi_source import FUNCTION

LARGE = 200  # lines of a function: smaller ones are compiled in no time
FEWEST = 8  # repetitions worth a loop
LONGEST = 6  # statements that repeat together: what CasADi makes of one selection, and some more
PLACE = re.compile(r"\ba(\d+)\b|\[(\d+)\]")
DECLARED = re.compile(r"^  casadi_real ((?:a\d+, )*a\d+);\n", re.MULTILINE)
_PER_LINE = 12


class _Line(NamedTuple):
    form: str  # the statement with its numbers left out
    places: tuple[int, ...]  # these numbers, in their order


class _Run(NamedTuple):
    first: int  # line
    length: int  # lines of the block that repeats
    times: int  # how often
    strides: tuple[int, ...]  # of the numbers of a block, from one repetition to the next


def rolled_loops(source: str) -> str:
    """Generated C in which long runs of like statements are loops.

    Args:
        source: as CasADi wrote it.

    Returns:
        The same statements in the same order. Variables over which a loop runs are elements of an array.
    """
    return FUNCTION.sub(lambda match: _rolled(match[0]) if match[0].count("\n") > LARGE else match[0], source)


def _rolled(function: str) -> str:
    """One function."""
    declared = [int(name[1:]) for group in DECLARED.findall(function) for name in group.split(", ")]
    if not declared:
        return function
    lines = DECLARED.sub("", function).split("\n")
    parsed = [_line(line) for line in lines]
    runs = _runs(parsed)
    if not runs:
        return function
    in_loops = _in_loops(parsed, runs)
    digits = len(DECLARED.search(function)[1].split(", ")[0]) - 1  # type: ignore[index]
    rest = [f"a{number:0{digits}}" for number in declared if number not in in_loops]
    head = [f"  casadi_real a[{max(in_loops) + 1}];"] if in_loops else []
    head += [f"  casadi_real {', '.join(rest[i : i + _PER_LINE])};" for i in range(0, len(rest), _PER_LINE)]
    written, done = [lines[0], *head], 1
    for run in (*runs, _Run(len(lines), 0, 0, ())):
        written += [_as_elements(line, in_loops) for line in lines[done : run.first]]
        if run.times:
            written += _loop(lines[run.first : run.first + run.length], run, in_loops)
        done = run.first + run.length * run.times
    return "\n".join(written)


def _line(text: str) -> _Line:
    """A statement, its form and its numbers."""
    found: list[int] = []

    def numbered(match: re.Match[str]) -> str:
        found.append(int(match[1] or match[2]))
        return "a" if match[1] else "[]"

    return _Line(PLACE.sub(numbered, text), tuple(found))


def _runs(lines: list[_Line]) -> list[_Run]:
    """The runs of a function, first to last, none within another."""
    found, first = [], 1
    while first < len(lines):
        run = next((run for length in range(1, LONGEST + 1) if (run := _run(lines, first, length))), None)
        if run is not None:
            found.append(run)
        first += run.length * run.times if run is not None else 1
    return found


def _run(lines: list[_Line], first: int, length: int) -> _Run | None:
    """The run of blocks of so many lines that begins at a line, if one does."""
    before = lines[first : first + length]
    if not all(line.form.endswith(";") and line.places for line in before):
        return None
    count, strides, place = 1, None, first + length
    while place + length <= len(lines):
        block = lines[place : place + length]
        if any(a.form != b.form for a, b in zip(before, block, strict=True)):
            break
        now = tuple(b - a for p, q in zip(before, block, strict=True) for a, b in zip(p.places, q.places, strict=True))
        if strides is not None and now != strides:
            break
        count, strides, before, place = count + 1, now, block, place + length
    return _Run(first, length, count, strides) if strides is not None and count >= FEWEST else None


def _in_loops(lines: list[_Line], runs: list[_Run]) -> set[int]:
    """Numbers of the variables over which loops run."""
    numbers: set[int] = set()
    for run in runs:
        block = lines[run.first : run.first + run.length]
        strides = iter(run.strides)
        for line in block:
            kinds = re.findall(r"\ba\b|\[\]", line.form)
            for kind, place in zip(kinds, line.places, strict=True):
                stride = next(strides)
                if kind == "a" and stride:
                    numbers.update(range(place, place + stride * run.times, stride))
    return numbers


def _loop(block: list[str], run: _Run, in_loops: set[int]) -> list[str]:
    """The loop of a run."""
    strides = iter(run.strides)

    def indexed(match: re.Match[str]) -> str:
        stride = next(strides)
        if not stride:
            return _element(match, in_loops)
        index = f"[{int(match[1] or match[2])}{stride:+}*i]"
        return f"a{index}" if match[1] else index

    statements = [f"  {PLACE.sub(indexed, line)}" for line in block]
    return [f"  for (casadi_int i = 0; i < {run.times}; ++i) {{", *statements, "  }"]


def _as_elements(line: str, in_loops: set[int]) -> str:
    """A statement outside loops, with the variables that are elements."""
    return PLACE.sub(lambda match: _element(match, in_loops), line)


def _element(match: re.Match[str], in_loops: set[int]) -> str:
    return f"a[{int(match[1])}]" if match[1] and int(match[1]) in in_loops else match[0]
