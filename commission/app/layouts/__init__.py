"""Layouts that were kept beside the one of now: what each comes to, how they differ, and a switch between them."""
