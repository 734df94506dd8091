"""How far recordings determine a policy, where they do not, and what to record next.

identify.py     the function `identifiability(policy, X, U)`, which checks the recordings
report.py       the report that it returns
information.py  H, what was observed, and G, what full observation would have shown
spectrum.py     the generalised eigenvalues of (H, G): the observed share of each direction of the policy
bound.py        bounds of the error, given the inconsistency
coverage.py     directions of motion that were not observed near a state
regions.py      recorded states where the policy is known least
advice.py       recordings that would lessen the expected error most
episodes.py     which recordings determine most, and which could be dropped
words.py        the report in sentences
"""

from unconstrain.diagnostics.identify import identifiability
from unconstrain.diagnostics.report import Identifiability

__all__ = ["Identifiability", "identifiability"]
