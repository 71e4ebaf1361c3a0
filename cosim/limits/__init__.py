"""How much an observer survives: printed bounds, exact tests and practical limits found by simulation, side by side."""

from cosim.limits.limit_table import LimitRow, limit_rows, limit_text
from cosim.limits.search import practical_limit, survives

__all__ = ["LimitRow", "limit_rows", "limit_text", "practical_limit", "survives"]
