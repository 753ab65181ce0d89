"""The networks: which there are, their cards, and whether they are what their cards say."""
