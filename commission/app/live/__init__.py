"""Live: sources of a vehicle that drives now, connected to from the page."""
