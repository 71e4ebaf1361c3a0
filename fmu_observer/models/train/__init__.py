"""Models of a train, of one mass or several. Data only."""
