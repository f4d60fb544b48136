"""The browser page: the only room that knows viser."""
