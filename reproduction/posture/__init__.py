"""A posture in 27 dimensions, with a wall in the way of the hands (section 4.4)."""
