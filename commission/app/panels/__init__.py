"""Panels around the floor, one file each: widgets that post actions, and text that shows the newest view."""
