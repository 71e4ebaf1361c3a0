"""How much an observer survives: printed bounds, exact tests and practical limits found by simulation, side by side."""

from cosim.limits.search import practical_limit, survives
from cosim.limits.table import LimitRow, limit_rows, limit_text

__all__ = ["LimitRow", "limit_rows", "limit_text", "practical_limit", "survives"]
