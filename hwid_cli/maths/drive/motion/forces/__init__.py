"""Forces on a drive."""
