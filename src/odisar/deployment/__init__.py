"""A calibrated twin as a folder that others can check, load and ask: no pickle, no MLflow."""
