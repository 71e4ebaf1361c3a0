"""What a run means, as data: roles of signals, errors in phases, counts of telegrams, warnings. Draws nothing."""
