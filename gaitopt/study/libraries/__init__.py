"""Libraries: the gaits of a sweep, interpolated between the points of its grid."""
