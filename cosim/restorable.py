"""What is saved with a run and returns with it to an earlier time. Standard library only."""

from __future__ import annotations

from typing import Any


class Restorable:
    """Takes part where a step is taken again; as it stands it remembers nothing."""

    def save(self) -> Any:
        """What it remembers from step to step, so that a step taken again comes out the same; None for nothing."""
        return None

    def restore(self, state: Any) -> None:
        """Return to what was saved.

        Args:
            state: as `save` gave it.
        """
        return
