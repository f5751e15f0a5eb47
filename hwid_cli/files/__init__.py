"""The only room that reads or writes data."""
