"""Pure functions on arrays and records: no files, no clock, no global random state."""
