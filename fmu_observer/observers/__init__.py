"""Observers as hybrid systems: what all of them are made of stands here, their rooms are named by what they serve.

`train`: the train; `generic`: any model; `motors`: traction motors; `exhibits`: the small plants of the theses.
"""
