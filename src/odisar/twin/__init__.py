"""The digital twin model (DTM): forecast, reconstruction, Monte Carlo dropout, training."""
