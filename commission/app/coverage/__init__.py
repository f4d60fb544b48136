"""The heatmap of the floor: what is seen, and how good a fix is."""
