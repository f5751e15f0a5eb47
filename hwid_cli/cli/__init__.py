"""Thin commands: parse, read, compute, write, show."""
