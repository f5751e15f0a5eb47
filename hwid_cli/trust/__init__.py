"""How far a model may be trusted on an input, and which input teaches most."""
