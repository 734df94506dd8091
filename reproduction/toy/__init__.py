"""A limit cycle in the plane (section 4.1): Figs. 3 and 4."""
