"""Lines: what an input does between communication points."""
