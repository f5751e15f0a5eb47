"""Rows of the derivatives of a model's output."""
