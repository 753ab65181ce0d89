"""The stroke network: it reads off the places of objects which of them a drawing joins."""
