"""Export recorded runs as data sets in formats of others."""
