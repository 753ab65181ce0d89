"""Change goals by what needs arithmetic: lengths, turns, steps across the table, exchanges of places."""
