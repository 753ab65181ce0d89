"""Generate training data and train: `structagent generate` and `structagent train`."""
