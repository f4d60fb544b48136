"""Arrays in, arrays out: rigid motions, curves, Gaussians, grids and rays. No word of vehicles or reflectors."""
