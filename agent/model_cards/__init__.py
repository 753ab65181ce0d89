"""List the networks, show their model cards, and verify that each network matches its card."""
