"""The page of a run or of a session: one self-contained HTML file that nothing is loaded into, without a script."""
