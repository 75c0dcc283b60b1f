"""Maps of occupancy grids, and tiles of the Earth."""
