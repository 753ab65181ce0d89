"""The evaluation protocol: what counts as success (`docs/protocol.md`)."""
