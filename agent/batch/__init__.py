"""Many instructions from a file, carried out by processes or a Ray cluster, and kept in a folder as they end."""
