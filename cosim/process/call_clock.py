"""How long a call has lasted, as who watches it sees it. Standard library only."""

from __future__ import annotations

from cosim.process.last_call import LastCall


class CallClock:
    """The time that the present call has taken, of those that are stated in a page.

    Attributes:
        seconds: how long it has been the present one [s].

    Args:
        page: which call is the present one.
    """

    def __init__(self, page: LastCall) -> None:
        self._page, self._seen = page, (0, b"")
        self.seconds = 0.0

    def add(self, elapsed: float) -> None:
        """Look at the page again.

        Args:
            elapsed: since the last time, without what this program itself was stopped for [s].
        """
        now = self._page.now()
        self.seconds = self.seconds + elapsed if now == self._seen and now[0] else 0.0
        self._seen = now

    @property
    def over_limit(self) -> str:
        """What to say of a call that lasts longer than it may; empty of any other one."""
        limit = self._page.seconds_at_most
        if not limit or self.seconds <= limit:
            return ""
        return f"has not returned for {limit:g} s, the limit of a call, which call_timeout sets"
