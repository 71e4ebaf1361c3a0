"""Tuning: parameters of observers and scenarios, searched for the smallest cost over several seeds."""
