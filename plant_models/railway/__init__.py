"""Railway plants: what rolls, what it measures, what drives it, and the ground under it."""
