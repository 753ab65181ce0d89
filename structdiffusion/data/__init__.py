"""Training data: scenes drawn, stored in shards, described and made into batches."""
