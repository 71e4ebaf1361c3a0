"""Bounds as they are printed, sufficient and no more: how large a gain must be, how short a gap. Plain NumPy, SciPy."""
