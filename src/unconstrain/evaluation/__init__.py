"""How well a policy predicts what was held out, beside ordinary regression, and what that comes to.

evaluation.py    a policy against recordings it has not seen: `evaluate`, `Evaluation`
comparison.py    a policy beside its model with other risks, on held-out episodes of what it was learnt from
scores.py        a line of either: errors of whole actions, and of what is shown
contact.py       which samples of other recordings were free, and how likely these are
alternatives.py  what else than the position may explain a motion, tried
fixed.py         equations that all motion obeys
following.py     where a policy leads from recorded starts
turns.py         whether a movement repeats itself
jumps.py         whether a few samples hold most of the motion
findings.py      all of these together
verdict.py       what all of it comes to, in a sentence
"""

from unconstrain.evaluation.comparison import Comparison, compare_risks, evaluate_held_out
from unconstrain.evaluation.evaluation import Evaluation, evaluate

__all__ = ["Comparison", "Evaluation", "compare_risks", "evaluate", "evaluate_held_out"]
