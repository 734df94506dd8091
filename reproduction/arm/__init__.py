"""A 7-DOF arm whose hand is constrained (section 4.2): Table I, a choice of models, and the same in physics."""
