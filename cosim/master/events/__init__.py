"""Events of the components themselves: clocks, time events, early returns, and what follows from them at the same
instant.
"""
