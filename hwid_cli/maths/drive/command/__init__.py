"""What becomes of the command before it drives the motion."""
