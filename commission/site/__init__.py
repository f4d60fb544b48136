"""What stands in the hall and what drives in it: frozen values that the engineer edits. No file, no estimator."""
