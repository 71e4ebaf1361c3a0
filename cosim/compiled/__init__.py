"""The compiled stepper: the plan executed by a C routine over the FMUs' own functions, bit-identical with the Python
stepper.
"""
