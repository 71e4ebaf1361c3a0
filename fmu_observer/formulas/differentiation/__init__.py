"""Sliding-mode differentiators of any order, explicit and implicit, and their gains."""
