"""Diagnosis: where a simulation and measurements disagree, and what is missing."""
