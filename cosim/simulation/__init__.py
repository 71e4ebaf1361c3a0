"""The class `Scenario`: built by a script or from a file, run, varied, saved and exported."""
