"""The law of the adaptive observers, in flight and from sample to sample."""
