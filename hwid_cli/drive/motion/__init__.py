"""Motion of a drive with every effect of the catalogue."""
