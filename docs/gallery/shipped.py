"""Running a scenario from a script, quietly."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from cosim import Outcome, Scenario


def run(name: str, changes: Mapping[str, Any] | None = None) -> Outcome:
    """Run a shipped scenario, or one in a file.

    Raises:
        RuntimeError: the run failed.
    """
    outcome = Scenario.load(name).run(overrides=changes, warn=lambda _warning: None)
    if outcome.failure is not None:
        raise RuntimeError(outcome.failure)
    return outcome
