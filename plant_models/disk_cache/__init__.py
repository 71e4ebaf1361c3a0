"""The user's cache on disk: results that were computed once, kept by the content of all that they depend on.

An entry has no date and is never invalidated: its name is a digest of what it follows from (`identity`), so what
follows from something else has another name. A damaged or foreign entry is reported in the log and computed again.
"""
