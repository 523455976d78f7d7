"""Inputs nobody would give on purpose: every one must end in a result or in one message.

`python -m tests.fuzz N` tries N inputs, `python -m tests.fuzz.interrupts N` N interruptions; some
of each run with the other tests. Every input follows from its kind and number.
"""
