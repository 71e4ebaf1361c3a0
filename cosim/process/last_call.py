"""The last call: which function of which component is being called, at what time. Standard library only.

It is in a page of memory that a watching process shares, so that it can be stated when this one is gone. To note
a call is one store of a number; the words behind the numbers are written to the page when they are asked for first.
"""

from __future__ import annotations

import mmap
from collections.abc import Iterator
from contextlib import contextmanager
from math import isnan, nan
from pathlib import Path

PAGE = 1 << 16
_CALL, TIME, LIMIT, ENDED, USED = range(5)
"""Cells of the page: number of the call, 0 for none; the time [s]; how long a call may last [s]; how the process ended;
bytes of words."""
TEXTS = 64
NOTE = PAGE // 2
LONGEST = 80
RUNNING = 0
WRITE, READ, STEP, EVENT = range(4)
_CONTENT = "content "
_OFTEN = ("setting inputs", "getting outputs", "doStep", "an event")
"""What a component is called for in every step: their numbers follow one another."""


class LastCall:
    """What is being called.

    `call[0]` is the number of the call, `time[0]` the time of the communication point from which it is made [s].
    Whoever calls stores there; `numbers` says what. `watched` says that another process looks at it, `timed` that it
    also keeps the time.

    Args:
        memory: one page, shared between the processes.
    """

    def __init__(self, memory: mmap.mmap) -> None:
        self.watched = self.timed = False
        self._use(memory)

    def _use(self, memory: mmap.mmap) -> None:
        self.memory = memory
        view = memoryview(memory)
        self.call, self.time = view[:8].cast("q"), view[8:16].cast("d")
        self._limit, self._cells = view[16:24].cast("d"), view[:TEXTS].cast("q")
        self._numbers: dict[tuple[str, str], int] = {}
        self._count = int(bytes(memory[TEXTS : TEXTS + self._cells[USED]]).count(b"\n"))
        self._unknown = self._four("of which nothing is known")

    def attach(self, path: Path) -> None:
        """Use the page that another process made with `make_page`; before anything is called.

        Args:
            path: of the page's file.
        """
        with path.open("r+b") as file:
            self._use(mmap.mmap(file.fileno(), PAGE))
        self.watched = True

    @property
    def address(self) -> int:
        """Where `call` is, for C; `time` is behind it."""
        import ctypes  # noqa: PLC0415 - the watching process does without

        return ctypes.addressof(ctypes.c_char.from_buffer(self.memory))

    @property
    def limit_address(self) -> int:
        """Where the longest time of a call is, for C: a double [s], 0 for any time."""
        return self.address + 8 * LIMIT

    # -- who calls --------------------------------------------------------------------------------------------------

    def number(self, component: str, what: str) -> int:
        """The number of a call, in words such as ``doStep``.

        Args:
            component: its name.
        """
        key = component, what[:LONGEST]
        if key not in self._numbers:
            self._numbers[key] = self._add(*key) or self._unknown
        return self._numbers[key]

    def numbers(self, component: str) -> int:
        """The number of the first of the calls `_OFTEN`; `WRITE`, `READ`, `STEP` and `EVENT` are added to it.

        Args:
            component: its name.
        """
        key = component, _OFTEN[0]
        if key not in self._numbers:
            self._numbers[key] = self._four(component) or self._unknown
        return self._numbers[key]

    def begin(self, component: str, what: str, time: float = nan) -> None:
        """A call that is made now and then begins at `time` [s]; whoever makes it stores 0 in `call[0]` at its end.

        Args:
            component: whose call it is. what: the call in words. What stands behind ``=`` in them is left out: a value
                is not part of the call.
            time: where the component stands [s].
        """
        key = component, what
        self.call[0] = self._numbers[key] if key in self._numbers else self.number(component, what.partition(" = ")[0])
        self.time[0] = time

    @contextmanager
    def making(self, component: str, what: str, time: float = nan) -> Iterator[None]:
        """Within this context a call is the present one; arguments as for `begin`.

        Args:
            component: its name.
        """
        self.begin(component, what, time)
        try:
            yield
        finally:
            self.call[0] = 0

    def limit(self, seconds: float | None) -> None:
        """A call may last so long [s]; None for any time.

        Args:
            seconds: longest time a call may take [s]; None for any.
        """
        self._limit[0] = seconds or 0.0

    def state_content(self, component: str, digest: str) -> None:
        """Say which file the code of a component is, for who finds this process gone.

        Args:
            component: its name. digest: of the file's content.
        """
        key = component, _CONTENT + digest
        if key not in self._numbers:
            self._numbers[key] = self._add(*key)

    def _four(self, component: str) -> int:
        """Four numbers, one after the other; 0 where there is no room for all of them."""
        first, *_, last = [self._add(component, what) for what in _OFTEN]
        return first if last else 0

    def _add(self, component: str, what: str) -> int:
        data = f"{component}\0{what}\n".encode()
        used = self._cells[USED]
        if TEXTS + used + len(data) > NOTE:
            return 0  # hundreds of components
        self.memory[TEXTS + used : TEXTS + used + len(data)] = data
        self._cells[USED] = used + len(data)
        self._count += 1
        return self._count

    # -- what the watching process should know ----------------------------------------------------------------------

    def note(self, text: str) -> None:
        """Leave a text, in place of the one before; empty for none."""
        data = text.encode()[: PAGE - NOTE - 8]
        self.memory[NOTE + 8 : NOTE + 8 + len(data)] = data
        self.memory[NOTE : NOTE + 8] = len(data).to_bytes(8, "little")

    def end(self, code: int) -> None:
        """The process comes to its end as it should, with this exit code."""
        self.call[0] = 0
        self._cells[ENDED] = 1 + code

    # -- who watches ------------------------------------------------------------------------------------------------

    @property
    def seconds_at_most(self) -> float:
        """How long a call may last [s]; 0 for any time."""
        return float(self._limit[0])

    @property
    def exit_code(self) -> int | None:
        """The exit code of a process that came to its end as it should; None of another."""
        ended = int(self._cells[ENDED])
        return None if ended == RUNNING else ended - 1

    @property
    def noted(self) -> str:
        """The text that was left."""
        size = int.from_bytes(self.memory[NOTE : NOTE + 8], "little")
        return self.memory[NOTE + 8 : NOTE + 8 + size].decode("utf-8", "replace")

    def now(self) -> tuple[int, bytes]:
        """Number and time of the present call: while both stay the same it is the same call. The time is its eight
        bytes, since one that is not known is NaN, which equals nothing.
        """
        return int(self.call[0]), bytes(self.memory[8:16])

    @property
    def content(self) -> str:
        """Digest of the file whose code the present call is in; empty where that is not known."""
        lines = self._lines()
        number = int(self.call[0])
        component = lines[number - 1].partition("\0")[0] if 0 < number <= len(lines) else None
        stated = [what for name, _, what in (line.partition("\0") for line in lines) if name == component]
        return next((what.removeprefix(_CONTENT) for what in reversed(stated) if what.startswith(_CONTENT)), "")

    @property
    def code_of_others(self) -> list[str]:
        """Names of the components whose files were stated, in order."""
        named = [line.partition("\0") for line in self._lines()]
        return list(dict.fromkeys(name for name, _, what in named if what.startswith(_CONTENT)))

    def _lines(self) -> list[str]:
        return self.memory[TEXTS : TEXTS + self._cells[USED]].decode("utf-8", "replace").split("\n")[:-1]

    def words(self) -> str:
        """The present call, e.g. ``component 'train' in doStep at t = 3.2 s``; empty where there is none."""
        number, time = int(self.call[0]), float(self.time[0])
        lines = self._lines()
        if not 0 < number <= len(lines):
            return ""
        component, _, what = lines[number - 1].partition("\0")
        return f"component '{component}' in {what}" + (f" at t = {time:g} s" if not isnan(time) else "")


def make_page(path: Path) -> LastCall:
    """A page in a file, to look at what another process does that is started afresh and attaches it.

    Args:
        path: of the page's file.
    """
    path.write_bytes(bytes(PAGE))
    with path.open("r+b") as file:
        return LastCall(mmap.mmap(file.fileno(), PAGE))


LAST_CALL = LastCall(mmap.mmap(-1, PAGE))
"""Of this process; a forked one shares it."""
