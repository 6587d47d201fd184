"""Simulators: labelled recordings of a machine, made from its physics and one base seed."""
