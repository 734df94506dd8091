"""Recordings of people and robots, whose policy nobody knows, measured part by part."""
