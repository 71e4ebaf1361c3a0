"""What variables were last set to, kept where Python and C find it. Knows no FMU."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping

from fmus.exchange.native_steps import CSent

Key = tuple[str, bytes]
"""A setter, and value references as C has them."""
Content = dict[Key, bytes]
"""Values by setter and value references, as C has them."""


class SentValues:
    """What each setter was given last, for each group of value references; unknown where another group has set one of
    them since.
    """

    def __init__(self) -> None:
        self._entries: dict[Key, CSent] = {}
        self._held: dict[Key, ctypes.Array[ctypes.c_char]] = {}

    def get(self, key: Key) -> bytes | None:
        """Values, None where they are not known.

        Args:
            key: of the group.
        """
        entry = self._entries.get(key)
        return self._held[key].raw if entry is not None and entry.known else None

    def put(self, key: Key, content: bytes) -> None:
        """A group was set. What was known of others that share a variable with it is known no more.

        Args:
            key: of the group. content: its values.
        """
        entry = self.entry(key)
        if entry.known and entry.bytes == len(content):
            self._held[key].raw = content
            return
        name, references = key
        own = set(memoryview(references).cast("I"))
        for (other, theirs), found in self._entries.items():
            if found.known and other == name and not own.isdisjoint(memoryview(theirs).cast("I")):
                found.known = False
        held = self._held[key] = ctypes.create_string_buffer(content, len(content))
        entry.content, entry.bytes, entry.known = ctypes.addressof(held), len(content), True

    def all(self) -> Content:
        """All that is known."""
        return {key: self._held[key].raw for key, entry in self._entries.items() if entry.known}

    def restore(self, content: Mapping[Key, bytes]) -> None:
        """This is known, and nothing else.

        Args:
            content: from `all`.
        """
        for entry in self._entries.values():
            entry.known = False
        for key, values in content.items():
            self.put(key, values)

    def entry(self, key: Key) -> CSent:
        """Where C finds a group.

        Args:
            key: of the group.
        """
        return self._entries.setdefault(key, CSent())
