"""Observers of any model, in rooms by what they share. The model is an option: ``model="pendulum"``."""
