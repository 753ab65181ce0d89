"""Goals of several parts: structures and relations that must hold together (evaluation protocol, part two)."""
