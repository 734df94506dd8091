"""Models so wide that their moments would take more than the samples do.

Moments of P parameters are P² numbers, and solving them is P³ work. Samples of a wide model are held instead, and the
same equations are solved by conjugate gradients, which need nothing but products of H with vectors: a pass over the
samples each.

    held.py            samples held in place of their moments
    passes.py          products with H, a block of samples at a time
    preconditioner.py  H of a subset of samples, which is inverted instead of H
    conjugate.py       preconditioned conjugate gradients, several systems side by side
    decay.py           solving for one λ
    choice.py          choosing λ
"""
