"""The Hammerstein-Wiener model: evaluate it, fit it, say how certain it is."""
