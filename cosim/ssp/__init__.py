"""SSP: systems of FMUs as other tools exchange them (System Structure and Parameterization 1.0 and 2.0), read and
written.

Reading ends in the tables of a scenario, writing begins with them; the master knows nothing of SSP. The parts of the
standard each have a reader: `structure` (SSD), `values` (SSV), `mapping` (SSM), `dictionary` (SSB). It may use
everything of `cosim` but the command line; `lxml` is loaded only by those who read or write such files.
"""

from plant_models.registry import lazy_names

__getattr__ = lazy_names(__name__)
