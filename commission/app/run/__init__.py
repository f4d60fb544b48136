"""The drive that is localized: source, play clock, time line, plots, and what a cycle looks like on the floor."""
