"""Normal equations of a step."""
