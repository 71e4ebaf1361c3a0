"""The checks themselves, one file for each subject; `fmus.check.catalogue` says which are run, and in which order."""
