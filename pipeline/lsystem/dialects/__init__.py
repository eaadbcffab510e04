"""The L-strings of other programs."""
