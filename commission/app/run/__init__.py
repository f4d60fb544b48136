"""The drive that is localized: source, virtual world, play clock, time line, plots, and each cycle on the floor."""
