"""What goes wrong in asking for a batch."""

from __future__ import annotations


class BatchError(ValueError):
    """What a batch was asked for cannot be; the message says what, for which member, and what to do."""
