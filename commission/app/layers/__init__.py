"""What is drawn on the floor, one file per thing. Layers draw frozen views; they decide nothing."""
