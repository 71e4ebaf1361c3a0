"""Moving-horizon estimation over time-stamped rows: pure formulas, no observer."""
