"""Falsification: a search, over what varies, for a run that breaks an expectation of its scenario; what is found is
made as small as it can be, and written as a scenario that fails.

`search` proposes points of the unit cube and knows no scenarios; `margins` is what is taken of a run; `smallest` takes
changes back; `falsify` does the runs, on the one engine of runs (`cosim.runs`); `weakness` is what comes out.
"""
