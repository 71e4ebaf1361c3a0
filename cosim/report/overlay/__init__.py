"""Several runs side by side: what differs between them, their figures, their tables."""
