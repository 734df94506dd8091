"""Inputs nobody meant to give, in any number, and what must come of each: one true sentence or a right result.

`python -m tests.fuzz --number 20000 --seed 1` (or `make fuzz N=20000 SEED=1`) makes inputs of four areas: `recordings`,
`archives`, `commands` (made from what the command line declares) and `arguments` (made from what functions declare).

- `engine` runs each input in a process of its own, with an end to its time and memory, and judges what came of it.
- `values` are the numbers, texts and arrays that programs stumble over.

Every input follows from its area, the seed and its number, so any can be made again; those that failed stay on the
disk, in a folder that is named.
"""
