"""Loading a floor map on the page: files, what they leave open, and the map that is made of them."""
