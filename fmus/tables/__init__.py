"""Tables as values, and how they are shown: in a terminal, on a page, as data."""
