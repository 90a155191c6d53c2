"""An arm that executes a job in simulation: reach, collisions, contact force, coverage."""
