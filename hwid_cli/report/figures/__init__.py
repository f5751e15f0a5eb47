"""Figures of the report: records in, figures out."""
