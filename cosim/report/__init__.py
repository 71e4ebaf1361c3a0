"""Reports of runs: figures, tables and pages of what `cosim.evaluation` found. The figures load matplotlib."""
