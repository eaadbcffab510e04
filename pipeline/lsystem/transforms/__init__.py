"""L-systems changed: generalised, shortened by repeats, grown."""
