"""Check whether the installation works, and name the repair for each failure: `structagent doctor`."""
