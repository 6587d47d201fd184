"""Figures: functions from results to a matplotlib ``Figure``, by topic."""
