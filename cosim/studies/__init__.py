"""Studies: one scenario run several times with something varied; several observers on one recorded run."""
