"""Balises: layouts, localisation, telegrams."""
