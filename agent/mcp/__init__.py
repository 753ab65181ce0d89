"""Serve one table to other programs by the Model Context Protocol."""
