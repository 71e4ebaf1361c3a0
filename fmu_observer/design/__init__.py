"""Gain design: functions that turn models and wishes into gains. Nothing here is needed at run time."""
