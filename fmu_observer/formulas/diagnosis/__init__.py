"""Formulas of fault detection and isolation, each once: filters and windows of residuals, alarms, redundant sensors,
an observer over a finite window, the inversion of a window for one parameter, thresholds and their false alarms, and
what an actuator has become.

Those that a detector executes are pure functions in plain NumPy that trace; thresholds and gains are computed before,
and parameters of actuators after. They know no block, no registry and no plant.
"""
