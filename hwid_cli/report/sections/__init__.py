"""Sections of the report: records in, blocks of the page out.

A stage's sections stand in the module of its name, as ``SECTIONS``.
"""
