"""Interchange in the page: files that come, a preview of what they change, files that go."""
