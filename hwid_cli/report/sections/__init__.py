"""Sections of the report: records in, blocks of the page out."""
