"""The benchmark of goals: its rows, a templated set, and the scores of readers."""
