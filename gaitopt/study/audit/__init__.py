"""Audit: optimal gaits of random problems, verified and then replayed by a second integrator."""
