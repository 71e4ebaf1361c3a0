"""Messages: what the components log, with time, category and status, in bounded memory. Standard library only.

A component that logs at every step must not fill the memory of a long run: the first and the last messages are kept,
those between are counted.
"""

from __future__ import annotations

import csv
from collections import Counter, deque
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Literal

from fmus.plain import plain

_FIRST_KEPT = _LAST_KEPT = 200
_LONGEST_TEXT = 2000  # letters
OF_THE_RUN = "not said by the FMU: "
"""How a message begins that a run adds to those of an FMU, and tells as a note."""
STATUSES = ("ok", "warning", "discard", "error", "fatal", "pending")
OMITTED = "omitted"
"""Status of the line that stands for messages that were not kept."""
FAULTS = frozenset({"discard", "error", "fatal"})
BAD = FAULTS | {"warning"}

LogChoice = Literal["all", "errors", "none"] | Sequence[str]
"""What a component shall log: everything, what is wrong, nothing, or these categories of its own."""


@dataclass(frozen=True, slots=True)
class Message:
    """One message of a component's log.

    Args:
        time: where the component stood [s]: within a step its start; NaN before initialisation.
        component: its name. category: as the component calls it, empty where it gives none.
        status: in FMI's words: ``ok``, ``warning``, ``discard``, ``error``, ``fatal``, ``pending``; or ``omitted`` for
            a line that says how many messages were not kept.
        text: what it says.
    """

    time: float
    component: str
    category: str
    status: str
    text: str

    def __str__(self) -> str:
        return self.text


class MessageLog:
    """The messages of one component: all are counted, the first and the last ones are kept.

    Args:
        component: its name. first, last: how many to keep of each.
    """

    def __init__(self, component: str, first: int = _FIRST_KEPT, last: int = _LAST_KEPT) -> None:
        self.component = component
        self.silent = False
        self.counts: Counter[str] = Counter()
        self._first: list[Message] = []
        self._last: deque[Message] = deque(maxlen=last)
        self._room = first
        self._latest: Message | None = None
        self._worst: Message | None = None

    def add(
        self, time: float, text: str | bytes | None, status: int | str = 0, category: str | bytes | None = None
    ) -> None:
        """Take a message; an empty one is dropped.

        Args:
            time: where the component stands [s]. text: what it says. status: of FMI, number or word. category: its own.
        """
        shown = _decoded(text).strip()[:_LONGEST_TEXT]
        if not shown:
            return
        message = Message(time, self.component, _decoded(category).strip(), _status(status), shown)
        self.counts[message.status] += 1
        self._latest = message
        if message.status in BAD:
            self._worst = message
        if self.silent:
            return
        if len(self._first) < self._room:
            self._first.append(message)
        else:
            self._last.append(message)

    @property
    def total(self) -> int:
        """How many messages there were."""
        return self.counts.total()

    @property
    def said_fault(self) -> bool:
        """Whether the component said of itself that something is wrong; a warning is no fault."""
        return any(self.counts[status] for status in FAULTS)

    @property
    def reason(self) -> str:
        """What the component said last about something wrong, or else last of all; empty where it said nothing."""
        found = self._worst or self._latest
        return "" if found is None else found.text

    def kept(self) -> list[Message]:
        """Those kept, in order, with a line in place of those that were not."""
        left_out = 0 if self.silent else self.total - len(self._first) - len(self._last)
        gap = []
        if left_out > 0:
            text = f"{left_out} messages here were counted and not kept"
            gap = [Message(self._last[0].time, self.component, "", OMITTED, text)]
        return [*self._first, *gap, *self._last]

    def __iter__(self) -> Iterator[Message]:
        return iter(self.kept())

    def __len__(self) -> int:
        return self.total


def in_order(logs: Iterable[MessageLog]) -> list[Message]:
    """All kept messages of several components by time; those before initialisation come first.

    Args:
        logs: one a component.
    """
    kept = [message for log in logs for message in log.kept()]
    return sorted(kept, key=lambda m: m.time if m.time == m.time else float("-inf"))


# -- file -------------------------------------------------------------------------------------------------------------

COLUMNS = tuple(f.name for f in fields(Message))


def write_messages(path: str | Path, messages: Iterable[Message]) -> None:
    """Write messages as CSV, one row each; line breaks inside a text stay inside its quotes.

    Args:
        path: of the file.

    Raises:
        OSError: the file cannot be written.
    """
    with Path(path).open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        writer.writerows([repr(m.time), m.component, m.category, m.status, m.text] for m in messages)


def read_messages(path: str | Path) -> list[Message]:
    """The messages that `write_messages` wrote.

    Args:
        path: of the file.

    Raises:
        OSError: the file cannot be read. ValueError: it is not such a file.
    """
    with Path(path).open(encoding="utf-8", newline="") as file:
        reader = csv.reader(file)
        if tuple(next(reader, ())) != COLUMNS:
            raise ValueError(f"{Path(path).name}: expected the columns {', '.join(COLUMNS)}.")
        return [_from_row(row, path) for row in reader]


def _from_row(row: Sequence[str], path: str | Path) -> Message:
    if len(row) != len(COLUMNS):
        raise ValueError(f"{Path(path).name}: a row has {len(row)} cells instead of {len(COLUMNS)}.")
    return Message(float(row[0]), *row[1:])


def _decoded(text: Any) -> str:
    if isinstance(text, bytes):
        text = text.decode("utf-8", "replace")
    return plain(str(text or "").replace("\0", ""))


def _status(status: int | str) -> str:
    if isinstance(status, str):
        return status
    return STATUSES[status] if 0 <= status < len(STATUSES) else f"status {status}"
