"""Thin pipeline stages: load parameters, read artefacts, call the library, write, track."""
