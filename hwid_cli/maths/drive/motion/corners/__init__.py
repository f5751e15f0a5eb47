"""Corners of the forces on a drive."""
