"""Learning from more data than memory holds: streams, clusters, and checkpoints of both."""
