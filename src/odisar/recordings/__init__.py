"""Recordings: one table of samples each, what is known about it, and whether it can be trusted."""
