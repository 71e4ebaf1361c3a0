"""What lies on the ground: adhesion zones and gradients, tables along them, balise layouts."""
