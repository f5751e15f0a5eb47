"""Motion between two events where all forces are linear."""
