"""Several observers beside one recorded run of the plant, compared."""
