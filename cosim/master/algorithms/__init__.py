"""Algorithms: in which order, and how often, the components are brought over one communication step."""
