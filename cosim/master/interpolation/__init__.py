"""Interpolation and extrapolation of inputs between communication points."""
