"""The public face, pinned: what people and scripts rely on, whatever modules are moved inside.

Commands and options, exit codes, the keys of JSON files, members of npz files, columns of CSV
files, headings of reports, names for use as a library. Nothing internal is imported: the command
line is called, and what it writes is read. Expectations are the texts in ``expected/``; where a
change is meant, ``python -m tests.contracts.renew`` writes them anew and prints what changed.
"""
