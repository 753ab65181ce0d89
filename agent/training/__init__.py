"""The verbs that make models: `structagent generate` and `structagent train`."""
