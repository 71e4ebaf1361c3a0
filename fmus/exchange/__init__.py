"""Model exchange FMUs as slaves: a solver moves their states, their events are handled, and what comes out has the
functions of co-simulation.
"""
