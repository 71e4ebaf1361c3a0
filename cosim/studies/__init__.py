"""Studies: one scenario run several times with something varied."""
