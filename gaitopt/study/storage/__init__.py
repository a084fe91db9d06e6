"""Storage of studies in progress: gait files in a folder, the key of a study, and reasons of failure."""
