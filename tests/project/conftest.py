"""Scripts that documents show run in processes of their own, forked from one that has imported the packages."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
import tiers
from forked import Done, Forked, Run


@pytest.fixture(scope="session")
def server(charge: Callable[[float], None]) -> Iterator[Forked]:
    """One server for all tests of a worker; waited for at the end, it brings the time of its children a second time."""
    forked = Forked()
    yield forked
    forked.close()
    charge(-forked.spent)


@pytest.fixture
def follows(request: pytest.FixtureRequest) -> list[str]:
    """What the test follows from: folders of modules and files of this project. Commands add to it what they load."""
    found: list[str] = []
    request.node.user_properties.append((tiers.FOLLOWS_FROM, found))
    return found


@pytest.fixture
def run_forked(server: Forked, tmp_path: Path, charge: Callable[[float], None], follows: list[str]) -> Run:
    """Runs a command line to its end; see `Forked.run`, which is told of the file for the output here."""

    def run(words: Sequence[str], **where: Any) -> Done:
        done = server.run(words, tmp_path / "written.txt", **where)
        charge(done.spent)
        follows.extend(done.loaded)
        return done

    return run
