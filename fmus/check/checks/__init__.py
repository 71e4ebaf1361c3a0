"""The checks themselves, one file for each subject; `fmus.check.known_checks` says which run, in which order."""
