"""What all verbs run on: settings, standard streams, output folders, progress, worker processes."""
