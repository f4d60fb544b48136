"""What is wrong with the site while it is edited, and where its routes ask too much of the vehicle."""
