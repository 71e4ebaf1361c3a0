"""File formats of result tables, one file each."""
