"""Bytes of scanners turned into values: pure functions that raise `DecodeError`. No file and no socket here."""
