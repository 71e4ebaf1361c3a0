"""Campaigns: thousands of runs of a scenario on the one engine of runs (`cosim.runs`), kept as a table in Parquet.

``[campaign]`` says what varies; `make_campaign` draws the settings of all runs (`variables`, `conditions`); chunks of
them are jobs (`chunk`), whose rows go to the store (`store`) as they end; `campaign_result` reads the table and says
what came of it.
"""

from plant_models.registry import lazy_names

__getattr__ = lazy_names(__name__)
