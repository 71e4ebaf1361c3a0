"""A train's network: nodes that own signals, protocols, delays; packets with the stamp of their measurement."""
