"""The toolchain: C files become the libraries of one or many platforms. Knows compilers and platforms, nothing of
models.
"""
