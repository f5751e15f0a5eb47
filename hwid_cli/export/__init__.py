"""Models as files for other programs: JSON, MAT, C and FMU, and JSON back again."""
