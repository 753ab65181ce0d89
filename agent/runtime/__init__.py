"""Provide what all verbs share: settings, standard streams, output folders, progress and worker processes."""
