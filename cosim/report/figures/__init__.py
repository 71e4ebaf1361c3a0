"""Figures of a report: what each shows, drawn on the axes it is given."""
