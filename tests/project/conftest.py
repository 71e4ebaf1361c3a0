"""Scripts that documents show run in processes of their own, forked from one that has imported the packages."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import pytest
from forked import Done, Forked, Run


@pytest.fixture(scope="session")
def server() -> Iterator[Forked]:
    """One server for all tests of a worker."""
    forked = Forked()
    yield forked
    forked.close()


@pytest.fixture
def run_script(server: Forked, tmp_path: Path, charge: Callable[[float], None]) -> Run:
    """Runs a script to its end, with these arguments."""

    def run(script: Path, arguments: Sequence[str]) -> Done:
        done = server.run(script, arguments, tmp_path / "written.txt")
        charge(done.spent)
        return done

    return run
