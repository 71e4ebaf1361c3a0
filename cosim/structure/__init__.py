"""The structure of a run: how components hang together, as data, text and picture; where a failed run went wrong."""
