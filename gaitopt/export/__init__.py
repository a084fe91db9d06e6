"""Results for other programs: trajectories as CSV, torques and gains as JSON, dynamics and controller as C."""
