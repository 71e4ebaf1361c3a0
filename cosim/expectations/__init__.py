"""Expectations: what a scenario demands of its own run, checked before the run and judged after it."""

from __future__ import annotations

from cosim.expectations.judge import judge
from cosim.expectations.judged import Judged

__all__ = ["Judged", "judge"]
