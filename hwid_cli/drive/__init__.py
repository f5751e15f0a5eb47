"""Physics simulation of servo drives: circuit, mechanics, friction, and the catalogue of effects."""
