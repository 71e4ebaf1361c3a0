"""The FMU that ended a process is remembered, see `fmus.isolation.crashes`. Touches the cache folder only."""

from __future__ import annotations

from cosim.process.last_call import LastCall
from fmus.isolation.crashes import note_crash


def remember_crash(page: LastCall, how: str) -> None:
    """Remember the FMU of the present call; nothing is done where there is none.

    Args:
        page: of the process that is gone. how: it ended, in words.
    """
    note_crash(page.content, f"{page.words()} {how}")
