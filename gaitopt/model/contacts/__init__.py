"""Contact modes, the reduced equations of motion of each mode, and the frictional impact law."""
