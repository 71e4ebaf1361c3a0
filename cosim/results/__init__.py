"""Results of runs: tables, balise telegrams and summaries, and the files that keep them."""
