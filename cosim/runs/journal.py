"""The journal of runs: a line for each job as soon as it is done, from which a later study goes on. Touches that file
only.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from cosim.errors import OutputError
from cosim.results.summary_file import restored
from cosim.runs.job import Failure, Job
from fmus.tables.plain_data import jsonable

JOURNAL = "runs.jsonl"
EARLIER = "runs.earlier.jsonl"
"""The journal of the study before, which was not resumed."""
_OF_0_1 = ("evaluations.jsonl", "../seeds.csv")
"""Where version 0.1 kept evaluations of a tuning and the rows of seeds, as seen from the folder of the journal."""


class Journal:
    """The file ``runs.jsonl`` in the folder of a study: ``key``, ``settings``, ``seed``, ``row``, ``failure``,
    ``outside`` and ``seconds`` of each job that is done.

    Args:
        directory: the folder; created where it does not exist.
        resume: whether jobs that stand in it are taken over; else it begins anew, and the former one becomes
            `EARLIER`.
        retry: whether all that failed is done again, and not only what failed for a reason outside.

    Raises:
        OutputError: the file cannot be read or written, or is to be resumed and was written by version 0.1.
    """

    def __init__(self, directory: Path, *, resume: bool = False, retry: bool = False) -> None:
        self.path = directory / JOURNAL
        self._known: dict[str, list[dict[str, Any]]] = {}
        try:
            directory.mkdir(parents=True, exist_ok=True)
            if resume:
                self._read(retry)
            elif self.path.is_file() and self.path.stat().st_size:
                self.path.replace(directory / EARLIER)  # whoever forgot to resume has lost nothing
            self._end_line()
        except OSError as error:
            raise OutputError(f"{self.path} cannot be written: {error.strerror or error}.") from error

    def taken(self, job: Job, fits: Callable[[Any], bool] = lambda _row: True) -> dict[str, Any] | None:
        """The line of a job that need not be done again; None where it must be.

        Args:
            job: of this study. fits: whether a row is what this study needs; asked where the job did not fail.
        """
        known = self._known.get(job.key, []) if self._known else []
        return next((entry for entry in reversed(known) if entry["failure"] is not None or fits(entry["row"])), None)

    def add(self, job: Job, row: Any, failure: Failure | None, seconds: float) -> None:
        """Write the line of a job; it is on the disk when this returns.

        Args:
            job: that is done. row: plain data. failure: why it did not reach its end, or None. seconds: wall time [s].

        Raises:
            OutputError: the file cannot be written.
        """
        entry = {
            "key": job.key,
            "settings": dict(job.settings),
            "seed": job.seed,
            "row": row,
            "failure": None if failure is None else failure.reason,
            "outside": failure is not None and failure.outside,
            "seconds": seconds,
        }
        write_line(self.path, entry)

    def _read(self, retry: bool) -> None:
        self._refuse_former()
        for entry in read_lines(self.path):
            if not entry["outside"] and (entry["failure"] is None or not retry):
                self._known.setdefault(entry["key"], []).append(entry)

    def _refuse_former(self) -> None:
        """What version 0.1 wrote is known by the age of files, and not by their content."""
        former = [name for name in _OF_0_1 if (self.path.parent / name).is_file()]
        path = (self.path.parent / former[0]).resolve() if former and not self.path.is_file() else self.path
        if path != self.path or any("row" not in entry for entry in read_lines(path)):
            raise OutputError(
                f"{path} was written by version 0.1, which knew runs by the age of their files; none of them can be "
                "taken over. Run without resuming, or choose another folder."
            )

    def _end_line(self) -> None:
        """A last line that was cut off stays no entry, and does not spoil the next one."""
        with self.path.open("ab+") as file:
            if file.tell() and (file.seek(-1, os.SEEK_END), file.read(1))[1] != b"\n":
                file.write(b"\n")


def write_line(path: Path, entry: dict[str, Any]) -> None:
    """Write a line behind those that are there.

    Args:
        path: of a file with a JSON object in each line. entry: plain data.

    Raises:
        OutputError: the file cannot be written.
    """
    try:
        with path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(jsonable(entry), allow_nan=False) + "\n")
    except OSError as error:
        raise OutputError(f"{path} cannot be written: {error.strerror or error}.") from error


def read_lines(path: Path) -> list[dict[str, Any]]:
    """What stands in a journal, in order; nothing where there is no file. A line that was cut off is no entry.

    Args:
        path: of a file with a JSON object in each line.

    Raises:
        OutputError: the file cannot be read.
    """
    entries: list[dict[str, Any]] = []
    try:
        lines = path.read_text(encoding="utf-8").splitlines() if path.is_file() else []
    except OSError as error:
        raise OutputError(f"{path} cannot be read: {error.strerror or error}.") from error
    for line in lines:
        with suppress(json.JSONDecodeError):
            entries.append(restored(json.loads(line)))
    return entries
