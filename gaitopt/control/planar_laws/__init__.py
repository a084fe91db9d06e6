"""Control laws of planar robots with any contacts: one law for each part of a period between two impacts."""
