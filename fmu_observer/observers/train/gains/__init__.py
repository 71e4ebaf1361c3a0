"""Gains of the train observers for a track and its gaps, believed by the observers' own certificates."""
