"""Graphical signatures: a window of past samples as a point of the plane, a record as a curve, and what is read off it.

Pure functions in NumPy after Omar 2012, chapters 2 to 4. `pencil` traces, so that observers may carry it; what
classifies, encloses or trains works on recordings. The room knows no block, no registry and no model.
"""
