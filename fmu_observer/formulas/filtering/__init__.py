"""Formulas of Kalman filters, each once: prediction, correction, sigma points, square roots.

Pure functions in plain NumPy that trace. They know no block, no registry and no model.
"""
