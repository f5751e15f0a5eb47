"""Events: reversals, break-aways, corners of forces."""
