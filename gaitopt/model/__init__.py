"""Models: symbolic mechanics, contact, impact, and the robots written with them."""
