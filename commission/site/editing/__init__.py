"""Edits of a site as pure functions: they take the values there are and return new ones. No page, no undo, no file."""
