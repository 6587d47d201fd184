"""Neural alternatives to the twin: trained like it, for the study rather than for every run."""
