"""What each call of the fixture found: one small file each, in a folder that the workers of pytest-xdist share.

Files, and not memory: a vendor's FMU may take its process with it, and what others found must not be lost. Standard
library and pytest only.
"""

from __future__ import annotations

import json
import shutil
import tempfile
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal
from uuid import uuid4

import pytest

Status = Literal["equal", "differs", "missing", "error", "new", "changed", "unchanged"]
AS_BEFORE = ("equal", "new", "changed", "unchanged")
"""Outcomes after which nothing is to be done."""
HEADLINES = ("changed", "common", "worst")
WORDS = {
    "equal": "as before",
    "differs": "differ",
    "missing": "without a baseline",
    "error": "could not be checked",
    "new": "new",
    "changed": "changed",
    "unchanged": "unchanged",
}


@dataclass(frozen=True)
class RegressionRecord:
    """What a call found.

    Args:
        test: node of the test. baseline: path of its JSON file. status: what became of it.
        lines: worst points, notes. files: pages and pictures by kind. staged: folder with the files to be written.
        headlines: what services show of it, by name: ``changed``, ``common``, ``worst``, where there is such a thing.
        file, line: where the test stands.
    """

    test: str
    baseline: str
    status: Status
    lines: list[str] = field(default_factory=list)
    files: dict[str, str] = field(default_factory=dict)
    staged: str = ""
    headlines: dict[str, str] = field(default_factory=dict)
    file: str = ""
    line: int = 1

    def properties(self) -> list[tuple[str, str]]:
        """Names and values for a JUnit file."""
        shown = {"baseline": Path(self.baseline).name, "status": self.status, **self.headlines, **self.files}
        return [(f"fmu_{name}", value) for name, value in shown.items()]


def verdict(records: Sequence[RegressionRecord]) -> str:
    """How many were checked, and what became of them.

    Args:
        records: of the session.
    """
    counts = Counter(record.status for record in records)
    return f"{len(records)} checked: " + ", ".join(f"{n} {WORDS[s]}" for s, n in sorted(counts.items()))


class Records:
    """The records of a session.

    Args:
        shared: folder that the controller gave to this worker; None for a controller, which makes one when it is
            needed.
    """

    KEY: pytest.StashKey[Records] = pytest.StashKey()
    INPUT = "fmu_records"

    def __init__(self, shared: str | None = None) -> None:
        self._shared, self._own = shared, ""

    @classmethod
    def of(cls, config: Any) -> Records:
        """The records of this process.

        Args:
            config: of the session.
        """
        if cls.KEY not in config.stash:
            config.stash[cls.KEY] = cls(getattr(config, "workerinput", {}).get(cls.INPUT))
        found: Records = config.stash[cls.KEY]
        return found

    def share_with(self, node: Any) -> None:
        """Pass a worker the place of the folder.

        Args:
            node: a worker of pytest-xdist.
        """
        node.workerinput[self.INPUT] = str(self.folder)

    @property
    def folder(self) -> Path:
        """The folder, made when it is first needed."""
        if self._shared is None and not self._own:
            self._own = tempfile.mkdtemp(prefix="fmu-baselines-")
        return Path(self._shared or self._own)

    def add(self, record: RegressionRecord) -> None:
        """Keep a record; it appears whole or not at all."""
        draft = self.folder / f"{uuid4().hex}.part"
        draft.write_text(json.dumps(asdict(record)), encoding="utf-8")
        draft.replace(draft.with_suffix(".json"))

    def stage(self) -> Path:
        """A new folder for the files of a baseline that may be written at the end."""
        folder = self.folder / uuid4().hex
        folder.mkdir()
        return folder

    def all(self) -> list[RegressionRecord]:
        """Every record, by test and baseline."""
        if self._shared is None and not self._own:
            return []
        found = [
            RegressionRecord(**json.loads(path.read_text(encoding="utf-8"))) for path in self.folder.glob("*.json")
        ]
        return sorted(found, key=lambda record: (record.test, record.baseline))

    def remove(self) -> None:
        """Remove the folder, if it was made here."""
        if self._own:
            shutil.rmtree(self._own, ignore_errors=True)
            self._own = ""
