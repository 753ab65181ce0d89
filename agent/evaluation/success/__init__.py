"""`structagent evaluate success`: how often what the planners imagine stands, measured on the same scenes."""
