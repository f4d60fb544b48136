"""The project itself: its folder and journal, its name, what is saved."""
