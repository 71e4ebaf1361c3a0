"""Components: FMUs and blocks behind one face."""
