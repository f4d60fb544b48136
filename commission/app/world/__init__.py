"""The virtual world: what is true in it, which the filter does not know."""
