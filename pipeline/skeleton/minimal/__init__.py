"""Minimal-length branch systems: from leaf positions to the shortest system of straight branches."""
