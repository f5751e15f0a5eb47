"""Push of the drive."""
