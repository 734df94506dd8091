"""The figures of the paper, as data: what ours stand beside. Source: ICRA 2009, the places named."""

# Fig. 3, over 100 data sets: mean and standard deviation.
TOY = {
    "inconsistency, 4 trajectories": {"nUPE": (0.3788, 0.2688), "nCPE": (0.1276, 0.1140)},
    "inconsistency, 40 trajectories": {"nUPE": (0.0027, 0.0087), "nCPE": (0.0002, 0.0002)},
    "direct, 40 trajectories": {"nUPE": (0.5709, 0.0853)},
}

# Table I, over 100 trials, mean and standard deviation; times 10^-2 in the paper, not here.
ARM = {
    (1.5, "1-2-3"): {
        "nUPE": (0.6433, 0.3203),
        "nCPE": (0.0291, 0.0036),
        "complementary nCPE": (0.1595, 0.0647),
    },
    (1.5, "4-5-6"): {
        "nUPE": (0.3475, 0.1912),
        "nCPE": (0.0249, 0.0022),
        "complementary nCPE": (0.1547, 0.0775),
    },
    (1.5, "1-3-5"): {
        "nUPE": (0.1617, 0.0381),
        "nCPE": (0.0320, 0.0027),
        "complementary nCPE": (0.0510, 0.0107),
    },
    (1.5, "2-4-6"): {
        "nUPE": (0.1035, 0.0182),
        "nCPE": (0.0272, 0.0023),
        "complementary nCPE": (0.0474, 0.0095),
    },
    (1.8, "1-2-3"): {
        "nUPE": (0.0809, 0.0576),
        "nCPE": (0.0047, 0.0008),
        "complementary nCPE": (0.0227, 0.0113),
    },
    (1.8, "4-5-6"): {
        "nUPE": (0.0536, 0.0296),
        "nCPE": (0.0035, 0.0003),
        "complementary nCPE": (0.0222, 0.0098),
    },
    (1.8, "1-3-5"): {
        "nUPE": (0.0227, 0.0064),
        "nCPE": (0.0045, 0.0004),
        "complementary nCPE": (0.0077, 0.0017),
    },
    (1.8, "2-4-6"): {
        "nUPE": (0.0142, 0.0031),
        "nCPE": (0.0040, 0.0004),
        "complementary nCPE": (0.0072, 0.0017),
    },
}
# Sec. IV-B: "all normalised errors in the order of 10^-9" for p = 2.0.
ARM_LINEAR_ORDER = 1e-9
# Sec. IV-B, under 1-2-3, by p.
ARM_DIRECT_NUPE = {1.5: (0.8344, 0.0120), 1.8: (0.8094, 0.0137), 2.0: (0.7962, 0.0139)}

# Table II, over 50 data sets.
GRASP = {
    "training constraints (nCPE)": {"direct": (0.1940, 0.0153), "inconsistency": (0.0056, 0.0022)},
    "unseen barrier (nCPE)": {"direct": (0.4678, 0.0264), "inconsistency": (0.0057, 0.0023)},
    "unconstrained (nUPE)": {"direct": (0.7014, 0.0430), "inconsistency": (0.0058, 0.0023)},
}

# Sec. IV-D, over 100 data sets.
POSTURE_NUPE = {"inconsistency": (0.00291, 0.00313), "direct": (0.639, 0.031)}
