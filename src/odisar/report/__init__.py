"""Results as figures, notebooks, and one report file."""
