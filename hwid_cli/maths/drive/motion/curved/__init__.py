"""Motion between two events where a force is curved."""
