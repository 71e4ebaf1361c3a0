"""The content of an FMU: the C of a model, its model description, its resource files. Text only; compiles and packs
nothing.
"""
