"""A finger that meets an obstacle (section 1): Fig. 1, and the policy learnt from several obstacles."""
