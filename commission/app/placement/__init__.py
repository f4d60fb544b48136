"""A suggested layout: demands, search, preview, acceptance."""
