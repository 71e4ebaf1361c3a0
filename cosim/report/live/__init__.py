"""The live page: curves, marks and tables that a reader explores in a browser, from one file, without a network."""
