"""Models of the small plants on which the theses show an observer. Data only."""
