"""Figures that users teach: read off examples, kept as files, shown as characters."""
