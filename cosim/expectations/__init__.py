"""Expectations: what a scenario demands of its own run, checked before the run and judged after it."""

from __future__ import annotations

from cosim.expectations.evaluate import evaluate
from cosim.expectations.evaluated import Evaluated

__all__ = ["Evaluated", "evaluate"]
