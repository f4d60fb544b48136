"""What the engineer asks of a project and its recordings: plain data in, plain data out. No file, no page."""
