"""The step Plan of the page: coverage of the floor, prediction along a route, and what depends on one reflector."""
