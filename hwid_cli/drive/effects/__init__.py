"""Declarations of effects, one module for each family."""
