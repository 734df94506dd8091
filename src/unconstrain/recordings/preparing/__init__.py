"""From the rows of a recording to samples: a line of small steps, each of which takes rows and returns rows."""
