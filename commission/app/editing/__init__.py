"""Editing the site on the page: tools, gestures and what they mean. The edits themselves are `site.editing`."""
