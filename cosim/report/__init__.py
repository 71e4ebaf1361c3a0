"""Reports of runs: metrics, tables, figures and a page. Imported one by one, since the figures load matplotlib."""
