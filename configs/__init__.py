"""Presets: `default` is all that there is, the others name only what differs."""
