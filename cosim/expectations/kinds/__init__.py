"""The kinds of expectations, one file each: keys, check before the run, judgement after it."""
