"""From the tables of a scenario to components, plan, master, run and result."""
