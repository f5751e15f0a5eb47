"""Physics simulation of servo drives: circuit, mechanics, friction."""
