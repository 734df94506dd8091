"""Our policies beside the methods that people know: GMR, LPV-DS, SEDS, DMP and behaviour cloning."""
