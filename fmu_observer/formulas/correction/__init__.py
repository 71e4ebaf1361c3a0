"""How much of a sampled innovation acts, and for how long after its sample."""
