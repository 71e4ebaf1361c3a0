"""What the model description of a delivered FMU states, as far as a baseline keeps it, and how two deliveries differ.
Knows no files.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from difflib import SequenceMatcher
from math import isclose
from typing import Any

from fmpy.model_description import ModelDescription, ModelVariable

from fmus.fmi.units import Units

INTERFACE = ("input", "output", "parameter", "structuralParameter")
"""Causalities of the variables that are kept; of the others only those that have a start value."""
_SIGNALS = ("input", "output")
SHOWN = 6
"""Changes that are named; of more the number is."""
_ALIKE = 0.6
"""Share of letters that two names keep when one is edited into the other, from which on they are near."""
_EXPERIMENT = ("startTime", "stopTime", "stepSize", "tolerance")


@dataclass(frozen=True, slots=True)
class DeliveredVariable:
    """A variable as its FMU describes it.

    Args:
        name: of the variable. causality: in the words of FMI. start: as it is written; empty where there is none.
        unit: name of its unit; empty where it has none.
    """

    name: str
    causality: str
    start: str = ""
    unit: str = ""


@dataclass(frozen=True)
class DeliveredFmu:
    """What a delivered FMU says of itself.

    Args:
        tool: that made it. date: when, as it is written.
        experiment: its default one as written: ``startTime``, ``stopTime``, ``stepSize`` [s], ``tolerance`` [1].
        variables: inputs, outputs, parameters, and what else has a start value, by name.
    """

    tool: str = ""
    date: str = ""
    experiment: Mapping[str, str] = field(default_factory=dict)
    variables: Mapping[str, DeliveredVariable] = field(default_factory=dict)

    @classmethod
    def of(cls, description: ModelDescription) -> DeliveredFmu:
        """What is kept of a model description.

        Args:
            description: of the FMU.
        """
        experiment = description.defaultExperiment
        stated = {key: getattr(experiment, key, None) for key in _EXPERIMENT}
        kept = [_variable(v) for v in description.modelVariables if v.causality in INTERFACE or v.start is not None]
        return cls(
            description.generationTool or "",
            description.generationDateAndTime or "",
            {key: str(value) for key, value in stated.items() if value is not None},
            {variable.name: variable for variable in sorted(kept, key=lambda variable: variable.name)},
        )

    def to_data(self) -> dict[str, Any]:
        """Plain data, one line of text for each variable: name, causality, start, unit, separated as in a CSV file."""
        lines = [_line([v.name, v.causality, v.start, v.unit]) for v in self.variables.values()]
        return {"tool": self.tool, "date": self.date, "experiment": dict(self.experiment), "variables": lines}

    @classmethod
    def from_data(cls, data: Mapping[str, Any]) -> DeliveredFmu:
        """What `to_data` made plain.

        Args:
            data: as from a JSON file.

        Raises:
            TypeError: a line of a variable holds too little.
        """
        rows = csv.reader(str(line) for line in data["variables"])
        variables = [DeliveredVariable(*row[:4]) for row in rows]
        experiment = {str(key): str(value) for key, value in data["experiment"].items()}
        return cls(str(data["tool"]), str(data["date"]), experiment, {v.name: v for v in variables})

    def changes_to(self, now: DeliveredFmu) -> list[str]:
        """What another delivery states otherwise, in words, the likeliest causes of other outputs first.

        Args:
            now: the other delivery.

        Returns:
            A few changes, of each kind the first before the second of any; behind them how many more there are.
        """
        gone = [v for name, v in self.variables.items() if name not in now.variables]
        new = [v for name, v in now.variables.items() if name not in self.variables]
        renamed = _renamed(gone, new)
        both = [(v, now.variables[name]) for name, v in self.variables.items() if name in now.variables]
        used = {id(variable) for pair in renamed for variable in pair}
        return _few(
            [
                [_start(one, two) for one, two in both if not _equal_start(one, two)],
                [_changed(two.name, "unit", one.unit, two.unit) for one, two in both if one.unit != two.unit],
                [_causality(one, two) for one, two in both if one.causality != two.causality],
                [f"{one.causality} {one.name} renamed {two.name}" for one, two in renamed],
                [f"{v.causality} {v.name} removed" for v in gone if id(v) not in used],
                [f"{v.causality} {v.name} added" for v in new if id(v) not in used],
                _experiment(self.experiment, now.experiment),
                [] if self.tool == now.tool else [f"tool {self.tool or 'not stated'} -> {now.tool or 'not stated'}"],
                [] if self.date == now.date else [f"made {self.date or 'not stated'} -> {now.date or 'not stated'}"],
            ]
        )


def _variable(variable: ModelVariable) -> DeliveredVariable:
    start = variable.start
    text = "" if start is None else " ".join(map(str, start)) if isinstance(start, list | tuple) else str(start)
    return DeliveredVariable(variable.name, variable.causality or "local", text, Units.name(variable) or "")


def _line(cells: Sequence[str]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="").writerow(cells)
    return text.getvalue()


def _equal_start(one: DeliveredVariable, two: DeliveredVariable) -> bool:
    """Whether two start values are the same, however they are written."""
    if one.start == two.start:
        return True
    before, after = _numbers(one.start), _numbers(two.start)
    return bool(before) and before == after


def _numbers(text: str) -> list[float]:
    """The numbers of a start value; none where it is a text."""
    words = {"true": "1", "false": "0"}
    try:
        return [float(words.get(word, word)) for word in text.split()]
    except ValueError:
        return []


def _start(one: DeliveredVariable, two: DeliveredVariable) -> str:
    before, after = one.start or "none", two.start or "none"
    if (one_numbers := _numbers(one.start)) and (two_numbers := _numbers(two.start)) and len(one_numbers) == 1:
        before, after = _short(one_numbers[0], two_numbers[0])
    return f"{two.name} start {_brief(before)} -> {_brief(after)}" + (f" {two.unit}" if two.unit else "")


def _short(one: float, two: float) -> tuple[str, str]:
    """Two numbers with as many digits as show that they differ."""
    for digits in (6, 9, 12):
        if f"{one:.{digits}g}" != f"{two:.{digits}g}" and isclose(float(f"{one:.{digits}g}"), one, rel_tol=1e-9):
            return f"{one:.{digits}g}", f"{two:.{digits}g}"
    return repr(one), repr(two)


def _brief(text: str) -> str:
    return text if len(text) <= 40 else text[:37] + "..."


def _changed(name: str, what: str, before: str, after: str) -> str:
    return f"{name} {what} {before or 'none'} -> {after or 'none'}"


def _causality(one: DeliveredVariable, two: DeliveredVariable) -> str:
    return _changed(two.name, "causality", one.causality, two.causality)


def _renamed(
    gone: Iterable[DeliveredVariable], new: Iterable[DeliveredVariable]
) -> list[tuple[DeliveredVariable, DeliveredVariable]]:
    """Variables that are gone, with the new one that equals them but for a near name. An input or output that is the
    only one of its unit on either hand may have any name.
    """
    gone, left, pairs = list(gone), list(new), []
    for variable in gone:
        equal = [v for v in left if _equal_role(v, variable)]
        found = max(equal, key=lambda v: _alike(variable, v), default=None)
        alone = variable.causality in _SIGNALS and len(equal) == 1 == sum(_equal_role(v, variable) for v in gone)
        if found is not None and (alone or _alike(variable, found) >= _ALIKE):
            left.remove(found)
            pairs.append((variable, found))
    return pairs


def _equal_role(one: DeliveredVariable, two: DeliveredVariable) -> bool:
    return (one.causality, one.unit) == (two.causality, two.unit) and _equal_start(one, two)


def _alike(one: DeliveredVariable, two: DeliveredVariable) -> float:
    return SequenceMatcher(None, one.name.lower(), two.name.lower()).ratio()


def _experiment(before: Mapping[str, str], now: Mapping[str, str]) -> list[str]:
    """What a default experiment says otherwise."""
    return [
        f"default {key} {before.get(key, 'none')} -> {now.get(key, 'none')}"
        for key in _EXPERIMENT
        if before.get(key) != now.get(key) and _numbers(before.get(key, "")) != _numbers(now.get(key, ""))
    ]


def _few(kinds: Sequence[Sequence[str]]) -> list[str]:
    """Some of the changes in their order, and how many more there are."""
    ranked = sorted((rank, place, text) for place, kind in enumerate(kinds) for rank, text in enumerate(kind))
    shown = sorted(ranked[:SHOWN], key=lambda change: (change[1], change[0]))
    more = len(ranked) - len(shown)
    return [text for _, _, text in shown] + ([f"and {more} more"] if more else [])
