"""Fitted policies for control loops, files and other languages: arrays, and nothing of scikit-learn's."""
