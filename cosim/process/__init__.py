"""The process: what is reported and kept when an FMU ends it, hangs in it, or somebody stops it from outside."""
