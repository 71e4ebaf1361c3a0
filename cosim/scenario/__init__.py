"""What a scenario says: TOML files and their includes, overrides, the tables with types and ranges, paths, saving."""
