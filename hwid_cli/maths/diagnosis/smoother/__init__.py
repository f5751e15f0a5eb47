"""Compiled smoother of the force that a simulation lacks."""
