"""Documentation inside an FMU: a page that says what it is, how it is built again, and the licences."""
