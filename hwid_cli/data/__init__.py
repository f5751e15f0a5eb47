"""Measurement files as recordings: formats, columns, clocks, calibration."""
