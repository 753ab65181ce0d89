"""Carry out many instructions from a file in processes or on a Ray cluster, and store each result as it arrives."""
