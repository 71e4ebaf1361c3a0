"""FMI: files, descriptions, instances, ports and values of FMUs and blocks, for FMI 1.0, 2.0 and 3.0, written once.

``fmus check``, the probe and the components of `cosim` all drive instances through this room.
"""
