"""Observers whose measurements are there at all times."""
