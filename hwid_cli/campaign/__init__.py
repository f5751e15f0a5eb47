"""The experiment as a whole: one module for each stage, and the pool they run on."""
