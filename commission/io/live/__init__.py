"""Live sources: what a vehicle and its scanners send now. The recordings of it are the room beside."""
