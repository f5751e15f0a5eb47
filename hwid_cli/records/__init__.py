"""Frozen dataclasses handed between rooms: they hold data and check their own shapes."""
