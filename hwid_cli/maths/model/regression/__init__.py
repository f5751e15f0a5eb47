"""Least squares that find linear blocks without a model to begin with."""
