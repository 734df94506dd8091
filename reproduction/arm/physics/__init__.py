"""The arm in MuJoCo's dynamics, with nothing of the method in the loop."""
