"""Recordings of drives: every format is read into the same records, chosen by what the file is."""
