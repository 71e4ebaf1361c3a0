"""Baselines: results that were found right, kept as readable files beside the tests or inside an FMU, and checks
against them.
"""

from __future__ import annotations

from cosim.baselines.baseline import Baseline, Header
from cosim.baselines.baseline_files import is_baseline, read_baseline, write_baseline
from cosim.baselines.recipe import Recipe
from cosim.baselines.regression import Regression, check

__all__ = ["Baseline", "Header", "Recipe", "Regression", "check", "is_baseline", "read_baseline", "write_baseline"]
