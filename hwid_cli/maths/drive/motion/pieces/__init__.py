"""Pieces of the command with the push of the drive."""
