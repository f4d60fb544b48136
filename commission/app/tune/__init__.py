"""The step Tune: every parameter of the localizer."""
