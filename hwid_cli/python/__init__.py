"""What the commands do, as functions on records in memory, for programs and notebooks."""
