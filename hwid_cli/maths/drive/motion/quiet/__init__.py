"""Stretches of motion without events."""
