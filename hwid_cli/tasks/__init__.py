"""How work is done: tasks, their cache, the runner, workers of this machine and clusters."""
