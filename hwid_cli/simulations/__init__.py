"""Simulations that a diagnosis can judge, whatever their kind."""
