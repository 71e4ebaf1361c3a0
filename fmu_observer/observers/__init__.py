"""Observers as hybrid systems, in rooms by how their measurements come; `train` holds those of the train."""
