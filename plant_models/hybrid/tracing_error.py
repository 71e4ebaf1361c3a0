"""The error of a system that cannot be traced, for those who do not trace themselves. Standard library only."""

from __future__ import annotations


class TracingError(TypeError):
    """A system's function uses something CasADi cannot trace; the message names the function and the line."""
