"""Training data and training: `structagent generate` and `structagent train`."""
