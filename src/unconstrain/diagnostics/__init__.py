"""What the recordings cannot tell: how far they determine a policy, where they do not, and what to record next.

information.py  H, what was seen, and G, what full observation would have shown
spectrum.py     their generalised eigenvalues: the share of each direction that was seen
bound.py        how large the error can be, given the inconsistency
coverage.py     motions never seen near a state
advice.py       the recordings that would tell most
episodes.py     which recordings tell most, and which could be dropped
report.py       all of it in one object, `identifiability(policy, X, U)`
words.py        and in sentences
pictures.py     and drawn
"""

from unconstrain.diagnostics.report import Identifiability, identifiability

__all__ = ["Identifiability", "identifiability"]
