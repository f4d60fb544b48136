"""The localizer predicted along a route."""
