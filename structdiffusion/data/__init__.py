"""Training data: sampling of scenes, storage in shards, datasheets and batches."""
