"""The digital twin capability (DTC): scores, thresholds, quadrants, attribution, assessment."""
