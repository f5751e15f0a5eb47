"""Results and cache on disk."""
