"""Listen to events: terminal, report files, session log, HTML page and Rerun."""
