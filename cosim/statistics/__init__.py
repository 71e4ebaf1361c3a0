"""Statistics one can defend, of runs that do not depend on each other: intervals that hold whatever the distribution,
paired comparisons, how many runs a claim needs, which variable matters. Arrays and small values; NumPy and SciPy.

All intervals hold 95 % unless another level is asked for. How often each does is measured in
docs/reference/statistics.md.
"""
