"""Configuration files as records, every key checked."""
